"""The tracker of Nguyen & Smeulders through occlusions, and slow ones that it takes in."""

import numpy as np
import pytest

from tests.trackers.template_clip import centre_errors, clip, final, made, track
from trackers.templates.appearance import Appearance, features_of


def test_an_occlusion_is_declared_bridged_and_revised():
    images, truth = clip(60)
    estimates, left = track(images, truth[0])
    hidden = [frame for frame, e in enumerate(estimates, 1) if not e.visible]
    declared, decided = hidden[0], hidden[-1] + 1
    assert 10 < declared <= 14  # the board has begun to cover the target, not yet wholly
    assert decided == declared + 35
    assert hidden == list(range(declared, decided))
    said = np.array([estimate.box for estimate in estimates[declared - 1 : decided - 1]])
    np.testing.assert_allclose(np.diff(said, 2, axis=0), 0, atol=1e-9)  # as it went
    revised = estimates[decided - 1].revised
    assert sorted(revised) == hidden
    assert all(e.revised is None for frame, e in enumerate(estimates, 1) if frame != decided)
    assert left == {}
    boxes = final(images, truth[0])
    assert centre_errors(boxes, truth).max() < 1.5
    ends = np.array([revised[frame] for frame in (declared, declared + 1, declared + 2)])
    np.testing.assert_allclose(np.diff(ends, 2, axis=0), 0, atol=1e-9)  # on a straight line


@pytest.mark.parametrize(
    ("longest", "last"), [(5, 5), (6, 5), (7, 7), (18, 11), (34, 19), (35, 35)]
)
@pytest.mark.parametrize("candidates", ["skipped", "all"])
def test_candidates_are_farther_and_farther_apart_up_to_the_longest_occlusion(
    longest, last, candidates
):
    images, truth = clip(14 + 35, hidden=60)
    estimates, _ = track(images, truth[0], longest_occlusion=longest, candidates=candidates)
    decided = next(e.revised for e in estimates if e.revised)
    assert len(decided) == (last if candidates == "skipped" else longest)
    examined = {e.details["cost"] for e in estimates[: max(decided)] if not e.visible}
    assert len(examined) == 1  # of the last match before


# Slow occluders, and whether they creep into the template.


def creeping(speed, features="rgb", **parameters):
    """A still target without noise, over which a board creeps by so many of 100 columns a frame.

    Returns the frame after the board's arrival in which an occlusion is declared, or None, and
    the share of the template that the board is then.
    """
    random = np.random.default_rng(0)
    still = random.integers(0, 200, (40, 100, 3), dtype=np.uint8)
    tracker = made([still], (0, 0, 100, 40), features=features, **parameters)
    target = features_of(still, features)
    appearance = Appearance(tracker._noise, target)
    appearance.start(target)
    for frame in range(60):
        image = still.copy()
        image[:, : speed * frame] = 250
        seen = appearance.seen(features_of(image, features))
        changed = float((appearance.template != target).any(axis=2).mean())
        if seen.share > tracker.parameters.gamma:
            return frame, changed
        appearance.update(seen, first=frame == 0)
    return None, changed


@pytest.mark.parametrize("features", ["rgb", "intensity"])
@pytest.mark.parametrize(("speed", "declared"), [(5, 6), (6, 5), (8, 4)])
def test_an_occluder_at_the_slowest_speed_or_faster_is_declared_before_it_is_in_the_template(
    speed, declared, features
):
    assert creeping(speed, features) == (declared, 0.0)


def test_a_slower_occluder_or_one_that_just_reaches_n_omax_becomes_the_template():
    assert creeping(4) == (None, 1.0)
    assert creeping(4, minimal_speed=0.04) == (7, 0.0)
    assert creeping(5, outlier_rule="reaches") == (None, 1.0)
    assert creeping(6, outlier_rule="reaches") == (5, 0.0)
    assert creeping(5, outlier_rule="reaches", rebootstrap=False) == (6, 0.0)


@pytest.mark.parametrize("rule", ["exceeds", "reaches"])
def test_n_omax_is_rounded_neither_way_by_arithmetic(rule):
    images, truth = clip(1)
    # 0.3 / 0.05 is less than 6 in floating point.
    noise = made(images, truth[0], gamma=0.3, minimal_speed=0.05, outlier_rule=rule)._noise
    assert noise.patience == {"exceeds": 7, "reaches": 6}[rule]
    between = made(images, truth[0], gamma=0.25, minimal_speed=0.1, outlier_rule=rule)._noise
    assert between.patience == 3
