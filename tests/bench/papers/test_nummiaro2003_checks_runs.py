"""What short runs of the tracker show on painted targets, and how all tables are kept."""

from math import isnan

import numpy as np
import pandas as pd
import pytest

from bench.papers import examination
from bench.papers.nummiaro2003.checks import entrance, examining, maximum, own_models
from bench.papers.nummiaro2003.checks.running import runs
from datasets import Sequence, SequenceError

pytestmark = pytest.mark.slow

RED, BLUE, GREY, GREEN = (40, 40, 200), (200, 60, 40), (128, 128, 128), (60, 160, 60)
ROWS, COLUMNS = np.mgrid[:120, :200] + 0.5


def painted(x, core=RED, rim=BLUE):
    """A target of 24x36 pixels at half the height, on grey."""
    image = np.full((120, 200, 3), GREY, np.uint8)
    distance = np.hypot((COLUMNS - x) / 12, (ROWS - 60) / 18)
    image[distance <= 1] = rim
    image[distance <= 0.6] = core
    return image


def walking(xs, images=None):
    """The target at these places; absent where that is NaN."""
    boxes = np.array([[x - 12, 42, 24, 36] for x in xs])
    boxes[np.isnan(xs)] = np.nan
    inside = (np.minimum(np.add(xs, 12), 200) - np.maximum(np.subtract(xs, 12), 0)) / 24
    images = images or [painted(x) for x in xs]
    return Sequence(
        "painted", images, boxes, fingerprint="p", visibility=np.nan_to_num(np.clip(inside, 0, 1))
    )


def test_the_mean_of_the_particles_is_at_the_maximum_where_nothing_else_looks_like_the_target():
    sequence = walking([40.0 + 2 * frame for frame in range(12)])
    tables = maximum.measure(sequence, quick=True)
    found = tables["maximum"]
    assert set(found["preset"]) == {"as-written", "recommended"}
    assert (found["distance"] < 0.25).all()
    assert found["near"].all()
    assert (found["greatest"] > found["coefficient"] - 0.01).all()  # between two pixels
    assert found["spread"].between(0.01, 1.0).all()


def test_the_distance_is_to_the_maximum_wherever_the_truth_is():
    xs = [40.0 + 2 * frame for frame in range(8)]
    ahead = walking(xs, [painted(40.0 + 3 * frame) for frame in range(8)])
    last = maximum.measure(ahead, quick=True)["maximum"].groupby("preset").last()
    assert (last["distance"] < 0.25).all()  # the truth lies half a half axis behind


def test_the_surface_is_a_grid_of_a_pixel_whose_greatest_value_is_that_of_the_table():
    tables = maximum.measure(walking([40.0 + frame for frame in range(8)]), quick=True)
    for preset, surface in tables["surface"].groupby("preset"):
        rows, drawn = (
            table[table["preset"] == preset]
            for table in (tables["maximum"], tables["surface_particles"])
        )
        last, drawn = rows.iloc[-1], drawn.set_index("kind")
        best = surface.loc[surface["coefficient"].idxmax()]
        assert surface["frame"].unique().tolist() == [last["frame"]]
        assert len(surface) == (2 * 18 + 1) * (2 * 27 + 1)
        assert best["coefficient"] == last["greatest"]
        assert (drawn.loc["greatest", ["x", "y"]] == best[["x", "y"]]).all()
        assert drawn.loc["particle", "weight"].sum() == pytest.approx(1.0)
        mean = drawn.loc["particle", ["x", "y"]].mul(drawn.loc["particle", "weight"], axis=0).sum()
        assert mean.to_numpy() == pytest.approx(drawn.loc["mean", ["x", "y"]].to_numpy(float))


def entered(tracking, inside, visibility):
    return entrance.entered(
        np.array(tracking, bool), np.array(inside, bool), np.array(visibility, float)
    )


def test_a_run_that_tracks_the_target_at_once_has_started_and_no_false_start():
    found = entered([0] * 10 + [1] * 20, [0] * 10 + [1] * 20, [0] * 8 + [0.5] * 2 + [1] * 20)
    assert found == {
        "empty_frames": 8,
        "false_starts": 0,
        "false_start_rate": 0,
        "no_false_start": 1,
        "visible_from": 10,
        "tracks_from": 10,
        "detected": 10,
        "started": 1,
        "kept": 1,
    }


def test_every_switch_to_tracking_without_the_target_is_a_false_start():
    tracking = [0, 1, 1, 0, 0, 1, 0, 0, 0, 0] + [0] * 14 + [1]
    found = entered(tracking, [0] * 24 + [1], [0] * 10 + [1] * 15)
    assert found["false_starts"] == 2
    assert found["false_start_rate"] == 20
    assert found["detected"] == 24
    assert (found["started"], found["kept"]) == (0, 0)  # 14 frames are too late


def test_a_target_that_walks_past_what_was_taken_for_it_is_not_found():
    visible = [0] * 10 + [1] * 20
    passing = entered([0] * 5 + [1] * 25, [0] * 14 + [1] * 3 + [0] * 13, visible)
    assert (passing["false_starts"], passing["no_false_start"]) == (1, 0)
    assert (passing["detected"], passing["started"], passing["kept"]) == (14, 0, 0)
    anew = entered([0] * 5 + [1] * 8 + [0] + [1] * 16, [0] * 14 + [1] * 3 + [0] * 13, visible)
    assert (anew["started"], anew["kept"]) == (1, 0)
    stays = entered([0] * 5 + [1] * 25, [0] * 14 + [1] * 16, visible)
    assert (stays["started"], stays["kept"]) == (1, 1)


def test_ten_frames_after_it_is_visible_are_in_time_and_the_background_is_no_target():
    late = entered([0] * 15 + [1] * 15, [0] * 15 + [1] * 15, [0] * 5 + [1] * 25)
    assert (late["started"], late["kept"]) == (1, 1)
    elsewhere = entered([0] * 6 + [1] * 24, [0] * 30, [0] * 5 + [1] * 25)
    assert elsewhere["tracks_from"] == 6
    assert isnan(elsewhere["detected"])
    assert (elsewhere["started"], elsewhere["kept"]) == (0, 0)


def test_a_target_that_comes_in_where_particles_wait_is_found_in_all_runs(monkeypatch):
    sequence = walking([np.nan] * 12 + [3.0 * frame - 6 for frame in range(60)])
    region = np.array([[0.0, 50.0, 24.0, 20.0]])
    monkeypatch.setattr(entrance, "entries", lambda name: region)
    tables = entrance.measure(sequence, quick=True)
    found = tables["entrance"]
    assert len(found) == 4
    assert (found["empty_frames"] == 12).all()
    assert (found["false_starts"] == 0).all()
    assert found["started"].all()
    assert found["kept"].all()
    waiting = tables["entrance_particles"].query("tracking == 0 and frame < 13")
    assert len(waiting) == 200
    assert waiting["x"].between(0, 24).all()
    assert waiting["y"].between(50, 70).all()
    assert tables["entrance_regions"].to_numpy().tolist() == region.tolist()
    pd.testing.assert_frame_equal(entrance.measure(sequence, quick=True)["entrance"], found)


def test_the_known_histogram_is_of_a_whole_target_in_the_light(monkeypatch):
    xs = [np.nan] * 12 + [3.0 * frame - 6 for frame in range(60)]
    dark = [
        painted(x, (10, 10, 40), (40, 10, 10)) if frame < 30 else painted(x)
        for frame, x in enumerate(xs)
    ]
    plain = walking(xs, dark)
    shade = np.arange(len(xs)) < 30
    shaded = Sequence(
        "shaded",
        dark,
        plain.boxes,
        fingerprint="s",
        visibility=plain.visibility,
        attributes={"shade": shade},
    )
    region = np.array([[0.0, 0.0, 200.0, 120.0]])
    monkeypatch.setattr(entrance, "entries", lambda name: region)
    assert entrance.measure(plain, quick=True)["entrance"]["tracks_from"].min() < 30
    assert entrance.measure(shaded, quick=True)["entrance"]["tracks_from"].min() >= 30
    with pytest.raises(SequenceError, match="never wholly visible in the light"):
        entrance.measure(walking([np.nan, *[3.0] * 60]), quick=True)


def test_a_target_that_comes_in_elsewhere_is_not_found_and_few_positives_start_sooner(monkeypatch):
    sequence = walking([np.nan] * 12 + [206.0 - 2 * frame for frame in range(60)])
    region = np.array([[0.0, 0.0, 24.0, 20.0]])
    monkeypatch.setattr(entrance, "entries", lambda name: region)
    found = entrance.measure_kick_offs(sequence, quick=True)["kick_off"]
    assert not found["started"].any()
    assert found["kick_off"].tolist() == [0.05, 0.1, 0.2, 0.4] * 2


def test_a_model_counts_as_wrong_where_clutter_looks_more_like_it_than_the_first_one():
    ellipse = np.array([[60.0, 60.0, 12.0, 18.0]])
    image = painted(60.0, GREEN, GREEN)
    green = np.zeros(512)
    green[(60 >> 5) * 64 + (160 >> 5) * 8 + (60 >> 5)] = 1.0
    red = np.zeros(512)
    red[(200 >> 5) * 64 + (40 >> 5) * 8 + (40 >> 5)] = 1.0
    mixed = 0.7 * red + 0.3 * green
    assert own_models.nearer(green[np.newaxis], green, image, ellipse) == 0.0
    assert own_models.nearer(np.stack([red, mixed]), red, image, ellipse) == 0.0
    assert own_models.nearer(np.stack([red, green]), red, image, ellipse) == 0.5
    assert own_models.nearer(np.stack([mixed, green]), mixed, image, ellipse) == 0.5


def test_models_of_their_own_stay_with_a_target_that_nothing_looks_like():
    sequence = walking([40.0 + frame for frame in range(70)])
    wrong = own_models.measure(sequence, quick=True)["wrong_models"]
    assert wrong["frame"].unique().tolist() == list(range(5, 61, 5))
    assert wrong["inside"].all()
    assert (wrong["nearer_clutter"] < 0.5).all()


def test_a_tracker_that_fails_is_named():
    images = [painted(40.0)] * 3
    broken = walking([0.5, 0.5, 0.5], images)
    broken = Sequence("broken", images, broken.boxes - [11, 0, 0, 0], fingerprint="b")
    with pytest.raises(SequenceError, match=r"broken: nummiaro2003\S* failed: .*too little"):
        runs(broken, [{"model_update": "false"}])


def in_turn(function, scenes, jobs, title):
    """Like `examined`, in this process."""
    return ((scene, function(scene)) for scene in scenes)


@pytest.fixture
def measured(monkeypatch):
    """Sequences that were measured, in turn, by two checks of one table each."""
    asked = []

    def table(name):
        def measure(sequence, quick):
            asked.append((sequence.name, name, quick))
            return {name: pd.DataFrame({"value": [1.5, np.nan]}), "none": pd.DataFrame()}

        return measure

    checks = (
        examining.Check(table("always"), ("plain/target",)),
        examining.Check(table("further"), ("plain/target",), everything=True),
        examining.Check(table("empty"), ("plain/target",), empty_start=True),
        examining.Check(table("others"), ("person",)),
    )
    monkeypatch.setattr(examining, "CHECKS", checks)
    monkeypatch.setattr(examination, "examined", in_turn)
    return asked


def test_tables_have_the_scene_in_front_and_none_is_empty(measured, tmp_path):
    tables = examining.examine(["plain/target:scene=3", "plain/target"], tmp_path, 1)
    assert list(tables) == ["always"]
    found = tables["always"]
    assert list(found) == ["name", "sequence", "scene", "light", "value"]
    assert found["scene"].tolist() == [3, 3, 0, 0]
    assert found["name"].tolist() == ["plain/target:scene=3"] * 2 + ["plain/target"] * 2
    assert set(found["sequence"]) == {"plain/target"}
    assert found["value"].isna().tolist() == [False, True] * 2


def test_what_was_measured_is_not_measured_again_and_everything_adds_to_it(measured, tmp_path):
    first = examining.examine(["plain/target"], tmp_path, 1)
    again = examining.examine(["plain/target"], tmp_path, 1)
    assert measured == [("plain/target", "always", False)]
    pd.testing.assert_frame_equal(first["always"], again["always"])
    both = examining.examine(["plain/target"], tmp_path, 1, everything=True)
    assert measured[1:] == [("plain/target", "further", False)]
    assert set(both) == {"always", "further"}


def test_a_quick_look_is_kept_apart_and_another_source_measures_anew(
    measured, tmp_path, monkeypatch
):
    examining.examine(["plain/target"], tmp_path, 1, quick=True)
    examining.examine(["plain/target"], tmp_path, 1)
    monkeypatch.setattr(examining, "source_digest", lambda file, package: ("other", {}))
    examining.examine(["plain/target"], tmp_path, 1)
    assert [quick for _, _, quick in measured] == [True, False, False]


def test_each_scene_is_examined_in_a_process_and_comes_with_its_answer():
    found = dict(examination.examined(abs, [-3, 2, -1], 2, "numbers"))
    assert found == {-3: 3, 2: 2, -1: 1}
    assert list(examination.examined(abs, [], 2, "numbers")) == []
