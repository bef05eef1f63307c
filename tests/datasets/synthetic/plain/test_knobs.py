"""Each parameter of `plain/target` has its documented effect in ground truth and images."""

import cv2
import numpy as np
import pytest

from tests.datasets.synthetic.scenes import box_centres


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


def test_noise_is_independent_between_frames(target):
    clean, noisy = target(noise=0, speed=0), target(noise=10, speed=0)
    a, b = (noisy[i].astype(float).ravel() - clean[i].ravel() for i in (3, 4))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.02
    assert abs(np.corrcoef(a[3:], a[:-3])[0, 1]) < 0.02


@pytest.mark.parametrize(("occlusion", "scene"), [(0, 0), (0.25, 5), (0.6, 0), (1, 5)])
def test_occlusion_is_the_largest_hidden_fraction(target, occlusion, scene):
    sequence = target(occlusion=occlusion, scene=scene)
    assert sequence.visibility.min() == pytest.approx(1 - occlusion, abs=2e-3)
    masks = np.array([sequence.mask(frame).sum() for frame in range(0, 120, 2)])
    assert masks.min() / masks[0] == pytest.approx(1 - occlusion, abs=0.05)
    assert sequence.present.all()
    assert sequence.attributes["occlusion"].any() == (occlusion > 0)


def test_absent_target_leaves_and_returns_smoothly(target):
    sequence = target(absence=25, scene=2)
    assert (~sequence.present).sum() == 25
    gone = np.flatnonzero(~sequence.present)
    assert (np.diff(gone) == 1).all()
    assert gone.mean() == pytest.approx(80, abs=1)
    place = box_centres(sequence)
    steps = np.hypot(*np.diff(place, axis=0).T)
    assert np.nanmax(steps) < 30
    assert (place[:50] == box_centres(target(scene=2))[:50]).all()


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
        """Pixels with a colour of the target, outside it."""
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


def test_blur_smooths_a_panned_ground_along_the_pan(target):
    sharp, soft = (target(scene=1, noise=0, pan=10, blur=blur)[7].astype(float) for blur in (0, 1))
    window = cv2.createHanningWindow((320, 240), cv2.CV_64F)
    (x, y), _ = cv2.phaseCorrelate(sharp.mean(axis=2), soft.mean(axis=2), window)
    assert np.hypot(x, y) < 0.5  # the exposure is centred on the frame's time
    along = [np.abs(np.diff(image, axis=1)).mean() for image in (sharp, soft)]
    assert along[1] < 0.6 * along[0]


def test_without_motion_blur_changes_nothing(target):
    still = {"speed": 0, "scene": 3}
    assert (target(**still)[9] == target(**still, blur=0.8)[9]).all()


def test_scene_looks_equal_at_another_length_and_size(target):
    assert (target(length=50)[0] == target(length=200)[0]).all()
    small, large = target(scene=1), target(scene=1, width=640, height=480)
    box = large.boxes[0] / small.boxes[0]
    assert box == pytest.approx(2, rel=0.12)
    colours = [image.reshape(-1, 3).mean(axis=0) for image in (small[0], large[0])]
    assert colours[0] == pytest.approx(colours[1], rel=0.1)
