"""Sequence `plain/target`: effects of parameters, ground truth and frames."""

import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import box_centres, mask_edges
from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.plain.scene import TargetMotion, target_truth


@pytest.mark.parametrize(("speed", "scene"), [(0, 0), (0.7, 1), (2, 0), (6, 2)])
def test_speed_is_the_displacement_per_frame(target, speed, scene):
    steps = np.hypot(*np.diff(box_centres(target(speed=speed, scene=scene)), axis=0).T)
    assert steps.mean() == pytest.approx(speed, rel=0.03, abs=0.02)
    assert steps.max() <= speed + 0.05


@pytest.mark.parametrize("scale", [0.25, 1, 2.2])
def test_scale_is_the_ratio_of_last_to_first_size(target, scale):
    sequence = target(scale=scale, scene=3)
    sizes = sequence.boxes[:, 2:]
    assert sizes[-1] / sizes[0] == pytest.approx(scale, rel=2e-3)
    assert (np.sign(np.diff(sizes, axis=0)) * np.sign(np.log(scale)) >= 0).all()
    assert (sequence.attributes["scale_change"].any()) == (scale != 1)
    areas = [sequence.mask(frame).sum() for frame in (0, -1 % len(sequence))]
    assert areas[1] / areas[0] == pytest.approx(scale**2, rel=0.04)


def test_light_is_the_missing_share_in_mid_sequence(target):
    sequence = target(light=0.6, noise=0, scene=1)
    brightness = np.array([image.mean() for image in sequence[::10]])
    assert brightness[6] / brightness[0] == pytest.approx(0.4, abs=0.01)
    assert brightness[-1] / brightness[0] == pytest.approx(1, abs=0.02)
    assert sequence.attributes["light_change"][60]
    assert not sequence.attributes["light_change"][[0, 119]].any()
    sides = sequence[27].astype(float), sequence[0]
    left, right = (
        (sides[0][:, part] / (sides[1][:, part] + 1.0)).mean()
        for part in (slice(0, 80), slice(240, 320))
    )
    assert abs(left - right) > 0.05  # the shade comes from one side


@pytest.mark.parametrize("noise", [0, 4, 15])
def test_noise_is_the_deviation_in_grey_levels(target, noise):
    clean, noisy = target(noise=0, scene=1)[5], target(noise=noise, scene=1)[5]
    unclipped = (clean > 60) & (clean < 195)
    difference = noisy.astype(float)[unclipped] - clean[unclipped]
    assert difference.std() == pytest.approx(noise, rel=0.03, abs=0.35)
    assert abs(difference.mean()) < 0.05 + noise * 0.02


@pytest.mark.parametrize(("occlusion", "scene"), [(0, 0), (0.25, 5), (0.6, 0), (1, 5)])
def test_occlusion_is_the_largest_hidden_fraction(target, occlusion, scene):
    sequence = target(occlusion=occlusion, scene=scene)
    assert sequence.visibility.min() == pytest.approx(1 - occlusion, abs=2e-3)
    masks = np.array([sequence.mask(frame).sum() for frame in range(0, 120, 2)])
    assert masks.min() / masks[0] == pytest.approx(1 - occlusion, abs=0.05)
    assert sequence.present.all()
    assert sequence.attributes["occlusion"].any() == (occlusion > 0)


@pytest.mark.parametrize("pan", [0.5, 7])
def test_pan_moves_the_ground_but_not_the_target(target, pan):
    still, panned = target(noise=0, scene=1), target(noise=0, scene=1, pan=pan)
    assert (still.boxes == panned.boxes).all()
    apart = max(1, round(4 / pan))
    grey = [panned[i].astype(np.float32).mean(axis=2) for i in (0, apart)]
    window = cv2.createHanningWindow((320, 240), cv2.CV_32F)
    (x, y), _ = cv2.phaseCorrelate(*grey, window)
    assert np.hypot(x, y) / apart == pytest.approx(pan, rel=0.05)


def test_clutter_has_the_target_colours_outside_the_mask(target):
    def target_coloured(sequence):
        """Return the number of pixels outside the target with one of its colours."""
        image, mask = sequence[0].astype(int) // 24, sequence.mask(0)
        codes = image @ [1, 16, 256]
        plain_ground = set((target(noise=0, scene=1)[0].astype(int) // 24 @ [1, 16, 256])[~mask])
        return np.isin(codes[~mask], list(set(codes[mask]) - plain_ground)).sum()

    counts = [target_coloured(target(noise=0, scene=1, clutter=count)) for count in (0, 4, 12)]
    assert counts[0] == 0
    assert 1000 < counts[1] < counts[2]
    sequence = target(clutter=12, scene=1)
    assert (sequence.boxes == target(scene=1).boxes).all()
    assert sequence.attributes["clutter"].any()
    assert not target(scene=1).attributes["clutter"].any()


def test_blur_smooths_the_target_at_equal_brightness(target):
    def steepness(sequence, frame):
        x, y, width, height = sequence.boxes[frame].astype(int)
        cut = sequence[frame][y : y + height, x : x + width].astype(float)
        return sum(np.square(np.diff(cut, axis=axis)).mean() for axis in (0, 1))

    fast = {"speed": 8, "noise": 0, "scene": 2}
    sharp, soft = target(**fast), target(**fast, blur=0.9)
    ratios = [steepness(soft, i) / steepness(sharp, i) for i in range(5, 115, 10)]
    assert max(ratios) < 0.8
    assert soft[50].mean() == pytest.approx(sharp[50].mean(), rel=0.01)
    assert (soft.boxes == sharp.boxes).all()
    still = {"speed": 0, "scene": 3}
    assert (target(**still)[9] == target(**still, blur=0.8)[9]).all()


SMALL = {"width": 128, "height": 96, "length": 40}


@st.composite
def target_parameters(draw):
    return {
        **SMALL,
        "scene": draw(st.integers(0, 10**6)),
        "speed": draw(st.floats(0, 8)),
        "scale": draw(st.floats(0.4, 2.5)),
        "occlusion": draw(st.sampled_from([0, 0.05, 0.3, 0.7, 1.0])),
        "absence": draw(st.integers(0, 13)),
        "clutter": draw(st.integers(0, 2)),
    }


@settings(max_examples=20, deadline=None)
@given(parameters=target_parameters())
def test_mask_fills_the_box_with_the_visible_area(target, parameters):
    sequence = target(**parameters)
    area_of_unit = np.pi if sequence.frames.motion.power == 2 else 3.7081493546
    for frame in range(0, len(sequence), 3):
        mask, box = sequence.mask(frame), sequence.boxes[frame]
        assert mask.shape == (96, 128)
        assert mask.dtype == np.bool_
        if not sequence.present[frame]:
            assert not mask.any()
            continue
        visible_area = sequence.visibility[frame] * area_of_unit * box[2] * box[3] / 4
        # straight edges may all fall on the same side of a half-covered pixel
        assert mask.sum() == pytest.approx(visible_area, abs=0.7 * (box[2] + box[3]))
        edges = np.concatenate([box[:2], box[:2] + box[2:]])
        if sequence.visibility[frame] == 1:
            assert np.abs(mask_edges(mask) - edges).max() <= 1
        elif mask.any():
            beyond = (mask_edges(mask) - edges) * [-1, -1, 1, 1]
            assert beyond.max() <= 1


@settings(max_examples=20, deadline=None)
@given(parameters=target_parameters())
def test_boxes_are_nan_for_the_requested_absence(parameters):
    truth = target_truth(TargetMotion(TargetParameters(**parameters)))
    absent = np.isnan(truth.boxes).any(axis=1)
    assert absent.sum() == parameters["absence"]
    assert np.isnan(truth.boxes[absent]).all()
    assert not absent[0]
    assert truth.visibility[0] == 1
    assert (truth.visibility[absent] == 0).all()
    assert ((truth.visibility >= 0) & (truth.visibility <= 1)).all()
    assert truth.attributes["out_of_view"][absent].all()
    if parameters["absence"] == 0:
        assert not truth.attributes["out_of_view"].any()
        deepest = truth.visibility[TargetMotion(TargetParameters(**parameters)).occlusion_frame]
        assert deepest == pytest.approx(1 - parameters["occlusion"], abs=1e-3)
        assert truth.visibility.min() >= deepest - 0.05  # a shrinking target is hidden more
        hidden = truth.visibility < 1
        assert (hidden == truth.attributes["occlusion"]).all()


def test_visibility_at_the_image_border_equals_closed_form():
    """Compare an ellipse cut by a straight edge with the segment's area."""
    motion = TargetMotion(TargetParameters(scene=1, absence=20, length=120))  # leaves below
    truth = target_truth(motion)
    assert motion.power == 2
    cut = np.flatnonzero(
        truth.attributes["out_of_view"]
        & (truth.boxes[:, 1] + truth.boxes[:, 3] > 240)
        & (truth.boxes[:, 0] > 0)
    )
    assert len(cut) > 5
    middle = truth.boxes[cut, 1] + truth.boxes[cut, 3] / 2
    d = np.clip((240 - middle) / (truth.boxes[cut, 3] / 2), -1, 1)
    expected = 0.5 + (d * np.sqrt(1 - d * d) + np.arcsin(d)) / np.pi
    np.testing.assert_allclose(truth.visibility[cut], expected, atol=1e-3)


def test_frame_memory_is_independent_of_the_length(target):
    peaks = []
    for length in (100, 100_000):
        sequence = target(length=length, width=96, height=64, clutter=2)
        sequence[0]
        tracemalloc.start()
        for frame in range(0, length, length // 50):
            sequence[frame]
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.5 * peaks[0]


HARD = {"length": 30, "scale": 1.6, "clutter": 3, "occlusion": 0.7, "absence": 5}
HARD |= {"light": 0.5, "blur": 0.7, "pan": 3.3, "speed": 6}


@settings(max_examples=6, deadline=None)
@given(
    scene=st.integers(0, 2**32 - 1),
    order=st.permutations(range(0, 30, 3)),
    width=st.integers(64, 150),
    height=st.integers(64, 120),
)
def test_frames_are_equal_in_any_order_and_thread(target, scene, order, width, height):
    parameters = {**HARD, "scene": scene, "width": width, "height": height}
    in_order, other = target(**parameters), target(**parameters)
    expected = [in_order[frame] for frame in sorted(order)]
    assert expected[0].shape == (height, width, 3)
    with ThreadPoolExecutor(4) as threads:
        images = dict(zip(order, threads.map(other.__getitem__, order), strict=True))
    for frame, image in zip(sorted(order), expected, strict=True):
        assert (images[frame] == image).all()


def test_fingerprint_depends_on_every_parameter(target):
    base = {"length": 50}
    others = {"scene": 1, "length": 51, "width": 321, "height": 241, "speed": 3, "scale": 2}
    others |= {"clutter": 1, "occlusion": 0.5, "absence": 1, "light": 0.1, "noise": 1}
    others |= {"blur": 0.1, "pan": 1}
    assert set(others) == set(TargetParameters.model_fields)
    sequences = [target(**base), *(target(**{**base, key: v}) for key, v in others.items())]
    assert len({sequence.fingerprint for sequence in sequences}) == len(sequences)
    assert target(**base).fingerprint == sequences[0].fingerprint
    assert all("_ground" not in vars(sequence.frames) for sequence in sequences)
