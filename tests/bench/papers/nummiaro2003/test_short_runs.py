"""What short runs of the tracker show on painted targets."""

import numpy as np
import pandas as pd
import pytest

from bench.papers.nummiaro2003 import short_runs
from datasets import Sequence, SequenceError

RED, BLUE, GREY, GREEN = (40, 40, 200), (200, 60, 40), (128, 128, 128), (60, 160, 60)
ROWS, COLUMNS = np.mgrid[:120, :200] + 0.5


def painted(x, core=RED, rim=BLUE):
    """A target of 24x36 pixels at half the height, on grey."""
    image = np.full((120, 200, 3), GREY, np.uint8)
    distance = np.hypot((COLUMNS - x) / 12, (ROWS - 60) / 18)
    image[distance <= 1] = rim
    image[distance <= 0.6] = core
    return image


def walking(xs, images=None, **told):
    """The target at these places; absent where that is NaN."""
    boxes = np.array([[x - 12, 42, 24, 36] for x in xs])
    boxes[np.isnan(xs)] = np.nan
    inside = (np.minimum(np.add(xs, 12), 200) - np.maximum(np.subtract(xs, 12), 0)) / 24
    seen = np.nan_to_num(np.clip(inside, 0, 1))
    images = images or [painted(x) for x in xs]
    return Sequence("painted", images, boxes, fingerprint="p", visibility=seen, **told)


COMING = [np.nan] * 12 + [3.0 * frame - 6 for frame in range(60)]


@pytest.fixture
def waited(monkeypatch):
    """Measures on a sequence where samples wait in a region."""

    def measured(measure, sequence, *region):
        monkeypatch.setattr(short_runs, "entries", lambda name: np.array([region], float))
        monkeypatch.setattr(short_runs, "begun_empty", lambda name: sequence)
        return measure(sequence, quick=True)

    return measured


def test_the_mean_of_the_particles_is_at_the_maximum_where_nothing_else_looks_like_the_target():
    tables = short_runs.maximum(walking([40.0 + 2 * frame for frame in range(12)]), quick=True)
    found = tables["maximum"]
    assert set(found["preset"]) == {"as-written", "recommended"}
    assert (found["distance"] < 0.25).all()
    assert found["near"].all()
    assert found["spread"].between(0.01, 1.0).all()
    last_frames = found.groupby("preset").last()
    of_presets = tables["surface_particles"].groupby("preset")
    for preset, surface in tables["surface"].groupby("preset"):
        last, drawn = last_frames.loc[preset], of_presets.get_group(preset).set_index("kind")
        best = surface.loc[surface["coefficient"].idxmax(), ["x", "y"]]
        assert surface["frame"].unique().tolist() == [last["frame"]]
        assert len(surface) == (2 * 18 + 1) * (2 * 27 + 1)
        assert (drawn.loc["greatest", ["x", "y"]] == best).all()
        away = np.hypot(*(drawn.loc["mean", ["x", "y"]] - best))
        assert away / 12 == pytest.approx(last["distance"])


def test_the_distance_is_to_the_maximum_wherever_the_truth_is():
    xs = [40.0 + 2 * frame for frame in range(8)]
    ahead = walking(xs, [painted(40.0 + 3 * frame) for frame in range(8)])
    last = short_runs.maximum(ahead, quick=True)["maximum"].groupby("preset").last()
    assert (last["distance"] < 0.25).all()  # the truth lies half a half axis behind


def switched(*lengths):
    """Flags of so many frames in turn, off at first."""
    return np.repeat(np.arange(len(lengths)) % 2 == 1, lengths)


@pytest.mark.parametrize(
    ("tracking", "inside", "visible", "said"),  # false starts, started, kept
    [
        ((10, 20), (10, 20), (10, 20), (0, 1, 1)),
        # Ten frames after it is visible are in time, fourteen are too late.
        ((15, 15), (15, 15), (5, 25), (0, 1, 1)),
        ((24, 1), (24, 1), (10, 15), (0, 0, 0)),
        ((1, 2, 2, 1, 19), (25,), (10, 15), (2, 0, 0)),
        # The background is no target, nor is one that walks past what was taken for it,
        ((6, 24), (30,), (5, 25), (0, 0, 0)),
        ((5, 25), (14, 3, 13), (10, 20), (1, 0, 0)),
        # but it is where tracking begins anew, or the target stays there.
        ((5, 8, 1, 16), (14, 3, 13), (10, 20), (1, 1, 0)),
        ((5, 25), (14, 16), (10, 20), (1, 1, 1)),
    ],
)
def test_what_becomes_of_a_run_that_waits(tracking, inside, visible, said):
    starts, started, kept = said
    found = short_runs.entered(switched(*tracking), switched(*inside), 1.0 * switched(*visible))
    assert found == {
        "false_start_rate": pytest.approx(100 * starts / visible[0]),
        "no_false_start": starts == 0,
        "started": started,
        "kept": kept,
    }


def test_a_target_that_comes_in_where_particles_wait_is_found_in_all_runs(waited):
    tables = waited(short_runs.entrance, walking(COMING), 0, 50, 24, 20)
    found = tables["entrance"]
    assert len(found) == 4
    assert found[["started", "kept", "no_false_start"]].all(axis=None)
    waiting = tables["entrance_particles"].query("tracking == 0 and frame < 13")
    assert len(waiting) == 200
    assert waiting["x"].between(0, 24).all()
    assert waiting["y"].between(50, 70).all()
    assert tables["entrance_regions"].to_numpy().tolist() == [[0, 50, 24, 20]]
    again = waited(short_runs.entrance, walking(COMING), 0, 50, 24, 20)["entrance"]
    pd.testing.assert_frame_equal(again, found)


def test_the_known_histogram_is_of_a_whole_target_in_the_light(waited):
    dark = np.arange(len(COMING)) < 30
    colours = {True: ((10, 10, 40), (40, 10, 10)), False: (RED, BLUE)}
    images = [painted(x, *colours[in_shade]) for x, in_shade in zip(COMING, dark, strict=True)]
    everywhere = 0, 0, 200, 120
    plain = waited(short_runs.entrance, walking(COMING, images), *everywhere)["entrance"]
    assert plain["started"].all()  # knows the dark one, which comes first
    shaded = walking(COMING, images, attributes={"shade": dark})
    assert not waited(short_runs.entrance, shaded, *everywhere)["entrance"]["started"].any()
    with pytest.raises(SequenceError, match="never wholly visible in the light"):
        waited(short_runs.entrance, walking([np.nan, *[3.0] * 60]), *everywhere)


def test_a_target_that_comes_in_elsewhere_is_not_found(waited):
    sequence = walking([np.nan] * 12 + [206.0 - 2 * frame for frame in range(60)])
    found = waited(short_runs.kick_offs, sequence, 0, 0, 24, 20)["kick_off"]
    assert not found["started"].any()
    assert found["kick_off"].tolist() == [0.05, 0.1, 0.2, 0.4] * 2


def test_doors_are_those_of_the_scene_as_it_begins_without_the_target():
    assert short_runs.begun_empty("nummiaro2003/person").first_frame > 0
    scene = short_runs.begun_empty("nummiaro2003/person:scene=3").name
    assert scene == "nummiaro2003/person:scene=3:start=empty"


def test_a_model_counts_as_wrong_where_clutter_looks_more_like_it_than_the_first_one():
    ellipse = np.array([[60.0, 60.0, 12.0, 18.0]])
    image = painted(60.0, GREEN, GREEN)
    green, red = np.zeros((2, 512))
    green[(60 >> 5) * 64 + (160 >> 5) * 8 + (60 >> 5)] = 1.0
    red[(200 >> 5) * 64 + (40 >> 5) * 8 + (40 >> 5)] = 1.0
    mixed = 0.7 * red + 0.3 * green
    assert short_runs.nearer(green[np.newaxis], green, image, ellipse) == 0.0
    assert short_runs.nearer(np.stack([red, mixed]), red, image, ellipse) == 0.0
    assert short_runs.nearer(np.stack([red, green]), red, image, ellipse) == 0.5
    assert short_runs.nearer(np.stack([mixed, green]), mixed, image, ellipse) == 0.5


def test_models_of_their_own_stay_with_a_target_that_nothing_looks_like():
    sequence = walking([40.0 + frame for frame in range(70)])
    wrong = short_runs.own_models(sequence, quick=True)["wrong_models"]
    assert wrong["frame"].unique().tolist() == list(range(5, 61, 5))
    assert (wrong["nearer_clutter"] < 0.5).all()
