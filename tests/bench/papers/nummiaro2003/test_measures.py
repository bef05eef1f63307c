"""Measures of a run whose target enters, is hidden three times, and leaves."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.bench.papers import measured_runs
from trackmark.bench.papers.nummiaro2003 import scenes
from trackmark.bench.papers.nummiaro2003.measures import Hiding, hidings
from trackmark.bench.papers.nummiaro2003.scenes import mean_state_at_maximum

value = measured_runs.values_of("nummiaro2003")

TRACKER = "nummiaro2003:preset=as-written:model_update=false"
N, COMES, LEAVES = 240, 20, 230
TREE = slice(100, 116)
SHORT = slice(180, 184), slice(200, 203)


def truth():
    """Return boxes and visibility of a target hidden by a tree and twice by other people."""
    boxes = np.full((N, 4), np.nan)
    frames = np.arange(COMES, LEAVES)
    boxes[frames] = np.column_stack([3.0 * frames, *np.tile([[50.0], [40.0], [90.0]], len(frames))])
    visibility = np.ones(N)
    visibility[TREE] = 0.0
    visibility[96:100] = visibility[116:120] = 0.6
    for occlusion in SHORT:
        visibility[occlusion] = 0.2
    visibility[:COMES] = visibility[LEAVES:] = 0.0
    visibility[LEAVES - 3 : LEAVES] = 0.3
    return boxes, visibility


def measured(estimates=None, **details):
    """Return a run that is on the target and initialises behind the tree, with given changes."""
    boxes, visibility = truth()
    usual = {
        "mode": constant_except(1, TREE, 0),
        "positive_appearances": np.where(visibility > 0.1, 90.0, 3.0),
    }
    run = {
        "details": {key: np.asarray(value, float) for key, value in {**usual, **details}.items()},
        "identity": SimpleNamespace(parameters={"kick_off": 0.1, "particles": 100}),
    }
    estimates = shifted([]) if estimates is None else estimates
    return measured_runs.measured("nummiaro2003", boxes, estimates, visibility, (800, 600), run)


def constant_except(usual, frames, value):
    """Return a constant by frame, with another value in some frames."""
    values = np.full(N, float(usual))
    values[frames] = value
    return values


def shifted(frames):
    """Return the true boxes, in some frames 500 pixels off."""
    boxes = np.nan_to_num(truth()[0], nan=1.0)
    boxes[frames, 0] += 500
    return boxes


def test_leaving_the_view_is_no_hiding():
    expected = [Hiding(100, 116, True), Hiding(180, 184, False), Hiding(200, 203, False)]
    assert hidings(measured()) == expected


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, 1),
        ({"positive_appearances": np.full(N, 10)}, 0),  # the count does not fall
        ({"mode": np.ones(N)}, 0),  # it does not initialise
        ({"mode": constant_except(1, slice(104, 170), 0)}, 0),  # it does not track again
        ({"mode": constant_except(1, slice(104, 140), 0)}, 1),
    ],
)
def test_initialisation_behind_the_tree_takes_three_steps(changes, expected):
    assert value("initialises_behind_tree", measured(**changes)) == expected


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, 1),
        ({"estimates": shifted(slice(181, 200))}, 0),  # off the target for too long
        ({"estimates": shifted(slice(181, 190))}, 1),
        ({"mode": constant_except(1, slice(205, 206), 0)}, 0),  # initialises
        ({"estimates": shifted(slice(179, 205))}, np.nan),  # off before either
        ({"estimates": shifted(slice(179, 190))}, 1),  # the second one counts
    ],
)
def test_short_occlusions_count_if_the_target_is_tracked_before(changes, expected):
    bridged = value("bridges_short_occlusions", measured(**changes))
    np.testing.assert_equal(bridged, expected)


def test_end_is_the_last_twenty_frames_in_view():
    assert value("on_target_at_end", measured(shifted(slice(LEAVES - 8, N)))) == 0.75
    assert value("on_target_at_end", measured(shifted(slice(0, 200)))) == 1.0
    # The last three frames before the exit are partly out of view, so that they do not count.
    for n_lost, expected in ((12, 1), (13, 0)):
        assert value("tracked_at_end", measured(shifted(slice(LEAVES - n_lost, N)))) == expected


def test_size_error_is_relative_to_the_truth():
    wide = shifted([])
    wide[:, 2] *= 1.25
    assert value("size_error", measured(wide)) == pytest.approx(0.25)


def test_mean_state_is_near_the_maximum_of_an_easy_target(monkeypatch):
    monkeypatch.setattr(scenes, "RUN", 6)
    assert mean_state_at_maximum("plain/target", TRACKER) == 1.0
