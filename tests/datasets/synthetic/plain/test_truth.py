"""Ground truth of `plain/target`, compared with the images."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.synthetic.scenes import mask_edges
from trackmark.datasets.synthetic.plain.parameters import TargetParameters
from trackmark.datasets.synthetic.plain.scene import (
    TargetMotion,
    silhouette_columns,
    target_truth,
)

SMALL = {"width": 128, "height": 96, "length": 40}


@st.composite
def parameters(draw):
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
@given(parameters=parameters())
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


def test_mask_edges_are_unbiased(target):
    """Averaged over all sub-pixel places, each edge is accurate to 0.2 pixels."""
    for scale in (0.5, 2):
        sequence = target(scale=scale, scene=1)
        x, y, width, height = sequence.boxes.T
        edges = np.array([mask_edges(sequence.mask(frame)) for frame in range(len(sequence))])
        error = edges - np.column_stack([x, y, x + width, y + height])
        assert np.abs(error.mean(axis=0)).max() < 0.2
        areas = np.array([sequence.mask(frame).sum() for frame in range(len(sequence))])
        assert areas.sum() == pytest.approx((np.pi / 4 * width * height).sum(), rel=0.01)


def test_target_motion_changes_only_box_and_shadow(target):
    """Image changes by the target's motion lie within box and shadow."""
    still = {"width": 320, "height": 240, "noise": 0, "scene": 4}
    image, away = target(**still)[0], target(**still)[60]
    box = target(**still).boxes
    changed = (image != away).any(axis=2)
    allowed = np.zeros_like(changed)
    for x, y, width, height in (box[0], box[60]):
        reach = 0.6 * height  # of the shadow
        allowed[
            int(max(0, y - reach)) : int(y + height + reach),
            int(max(0, x - reach)) : int(x + width + reach),
        ] = True
    assert not changed[~allowed].any()
    assert changed[target(**still).mask(0)].mean() > 0.99


@pytest.mark.parametrize("frame", [0, 119])
def test_vivid_target_pixels_agree_with_box_and_mask(target, frame):
    """An orange and blue target on grey stones can be segmented from the image alone."""
    sequence = target(scene=2, scale=2.5, noise=0)
    image, mask = sequence[frame].astype(int), sequence.mask(frame)
    vivid = image.max(axis=2) - image.min(axis=2) > 0.45 * (image.max(axis=2) + 10)
    assert vivid[mask].mean() > 0.85
    assert vivid[~mask].mean() < 0.005
    x, y, width, height = sequence.boxes[frame]
    assert np.abs(mask_edges(vivid) - [x, y, x + width, y + height]).max() <= 1.2


@settings(max_examples=20, deadline=None)
@given(parameters=parameters())
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


def test_visibility_in_closed_form_at_the_edge_of_the_view():
    """Compare an ellipse cut by a straight edge with the segment's area."""
    truth = target_truth(
        TargetMotion(TargetParameters(scene=1, absence=20, length=120))  # leaves below
    )
    motion = TargetMotion(TargetParameters(scene=1, absence=20, length=120))
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


@pytest.mark.parametrize(("power", "area"), [(2, np.pi), (4, 3.7081493546)])
def test_silhouette_columns_sum_to_its_area(power, area):
    x, chord = silhouette_columns(power)
    assert (2 * chord).sum() * (x[1] - x[0]) == pytest.approx(area, rel=1e-3)


def test_loading_a_long_sequence_renders_nothing(target):
    parameters = {"length": 100_000, "clutter": 3, "occlusion": 1, "absence": 1000, "light": 0.5}
    sequence = target(**parameters)
    assert len(sequence) == 100_000
    assert "_ground" not in vars(sequence.frames)
    tracemalloc.start()
    target(**parameters)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6


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
