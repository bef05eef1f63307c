"""What is said of a scene before any tracker runs: closed forms on painted targets."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import datasets
from bench.experiments.experiment import read_experiment
from bench.papers.multipart import drawing, scenes
from bench.papers.multipart.scenes import (
    FRAMES,
    INITIAL,
    JITTERS,
    Appearance,
    clutter_states,
    jittered,
    part_distance,
    separability,
    states_of,
)
from datasets import Sequence
from datasets.text_form import parse_text

BOX = np.array([150.0, 60.0, 24.0, 78.0])
WHOLE = np.array([144.0, 50.0, 36.0, 100.0])


def painted(upper, lower, ground, twin_at=None):
    """A two-coloured person on one colour; maybe another one who looks the same."""
    image = np.full((220, 320, 3), ground, np.uint8)
    for x in [BOX[0], *([] if twin_at is None else [twin_at])]:
        left, top, middle, bottom = int(x), 60, 99, 138
        image[top:middle, left : left + 24] = upper
        image[middle:bottom, left : left + 24] = lower
    return image


def sequence(images, visibility=1.0):
    n = len(images)
    boxes, whole = np.tile(BOX, (n, 1)), np.tile(WHOLE, (n, 1))
    seen = np.broadcast_to(visibility, n)
    return Sequence(
        "painted", images, boxes, fingerprint="p", regions={"full": whole}, visibility=seen
    )


RED, BLUE, GREY, GREEN = (40, 40, 200), (200, 60, 40), (128, 128, 128), (60, 160, 60)


def test_halves_of_other_colours_are_as_far_apart_as_can_be_and_equal_ones_not_at_all():
    assert part_distance(painted(RED, BLUE, GREY), BOX) == pytest.approx(1.0)
    assert part_distance(painted(RED, RED, GREY), BOX) == 0.0


def test_swapped_halves_are_the_same_to_a_single_histogram_and_another_thing_to_two():
    model = Appearance(painted(RED, BLUE, GREY), BOX)
    single, multi = model.distances(painted(BLUE, RED, GREY), states_of(BOX[np.newaxis]))
    assert single[0] < 0.02
    assert multi[0] > 0.4


def test_a_target_on_a_plain_ground_always_beats_the_clutter():
    images = [painted(RED, BLUE, GREY)] * 80
    assert separability(sequence(images)) == (FRAMES, 1.0, 1.0)


def test_a_twin_in_sight_is_as_near_as_the_target_which_is_then_no_longer_nearer():
    images = [painted(RED, BLUE, GREY)] * 60 + [painted(RED, BLUE, GREY, twin_at=198)] * 60
    frames, single, multi = separability(sequence(images))
    assert frames == FRAMES
    assert single == multi == pytest.approx(0.5, abs=0.03)


def test_a_twin_more_than_three_widths_away_does_not_count():
    images = [painted(RED, BLUE, GREY, twin_at=260)] * 60
    assert separability(sequence(images))[1:] == (1.0, 1.0)


def test_two_colours_the_wrong_way_round_nearby_confuse_a_single_histogram_alone():
    image = painted(RED, BLUE, GREY)
    image[60:99, 198:222], image[99:138, 198:222] = BLUE, RED
    assert separability(sequence([painted(RED, BLUE, GREY)] + [image] * 60))[1:] == (0.0, 1.0)


def test_occluded_frames_are_not_examined():
    images = [painted(RED, BLUE, GREY)] * 60 + [painted(GREEN, GREEN, GREEN)] * 60
    opened = sequence(images, np.repeat([1.0, 0.4], 60))
    assert separability(opened) == (FRAMES, 1.0, 1.0)


@given(
    x=st.floats(0, 600), y=st.floats(0, 400), width=st.floats(10, 100), height=st.floats(20, 300)
)
def test_clutter_is_what_a_score_calls_a_miss_within_three_widths(x, y, width, height):
    box = np.array([x, y, width, height])
    whole = np.array([x - width / 4, y - 0.18 * height, 1.5 * width, 1.28 * height])
    states = clutter_states(box, whole)
    offsets = states[:, :2] - (box[:2] + box[2:] / 2)
    assert len(states) > 0
    assert np.abs(offsets).max() <= 3 * width * (1 + 1e-9)
    inside = (states[:, :2] >= whole[:2]) & (states[:, :2] <= whole[:2] + whole[2:])
    assert not inside.all(axis=1).any()
    assert (states[:, 2] == width * height).all()


def test_jittered_rectangles_stay_within_five_per_cent():
    boxes = np.array(list(jittered(BOX, np.random.default_rng(0))))
    assert len(boxes) == JITTERS
    assert np.abs((boxes[:, :2] - BOX[:2]) / BOX[2:]).max() <= 0.05
    assert np.abs(boxes[:, 2:] / BOX[2:] - 1).max() <= 0.05
    assert boxes.std(axis=0).min() > 0


@pytest.mark.parametrize(
    ("single", "multi", "frames", "kept"),
    [(0.5, 0.9, FRAMES, True), (0.5, 0.79, FRAMES, False), (0.8, 0.1, FRAMES, True)]
    + [(0.5, 0.9, FRAMES - 1, False)],
)
def test_a_scene_is_kept_by_the_better_of_the_two_and_needs_fifty_frames(
    single, multi, frames, kept, tmp_path, monkeypatch
):
    log = {"name": "plain/target", "fingerprint": datasets.load("plain/target").fingerprint}
    log |= {"frames": frames, "single": single, "multi": multi}
    log |= {f"{key}_{name}": 0.4 for key in ("distance", "multi") for name in INITIAL.values()}
    monkeypatch.setattr(scenes, "LOG", tmp_path / "log" / "scenes.csv")
    (tmp_path / "log").mkdir()
    pd.DataFrame([log]).to_csv(scenes.LOG, index=False)
    tables = scenes.measured(["plain/target"], tmp_path, 1)  # which examines nothing
    assert scenes.kept(tables) == {"plain/target": kept}
    assert list(tables["switch"]["init"]) == ["full", "boxes", "tight"]
    again = scenes.measured(["plain/target"], tmp_path, 1)
    pd.testing.assert_frame_equal(again["static"], tables["static"])


def log_row(name, passes):
    return {"name": name, "frames": FRAMES, "single": 0.5, "multi": 0.9 if passes else 0.5}


def test_scenes_are_drawn_until_enough_of_them_pass():
    bad = {"multipart/5:light=dappled:scene=6", "multipart/5:light=dappled:scene=12"}
    rows = drawing.drawn("multipart/5", "dappled", lambda name: log_row(name, name not in bad))
    numbers = [4, 5, 6, 7, 12, 13, 14, 15]
    assert [row["name"] for row in rows] == [
        f"multipart/5:light=dappled:scene={number}" for number in numbers
    ]


def test_a_gate_that_too_few_scenes_pass_is_told(monkeypatch):
    monkeypatch.setattr(drawing, "MOST", 3)
    with pytest.raises(RuntimeError, match="only 0 of 3 scenes of multipart/5 in even light pass"):
        drawing.drawn("multipart/5", "even", lambda name: log_row(name, False))


def named(experiment):
    """Canonical names of an experiment's scenes, whose truth is not computed."""
    asked = (parse_text(source.text) for source in read_experiment(experiment).sequences)
    return {
        drawing.name_of(name, options.get("light", "even"), int(options["scene"]))
        for name, options in asked
    }


def test_experiments_run_the_scenes_that_were_drawn():
    log = scenes.read_log(scenes.LOG)
    passing = dict(zip(log["name"], scenes.passes(log), strict=True))
    assert named("multipart-table-1") == {name for name, passes in passing.items() if passes}
    assert named("multipart-dropped") == {name for name, passes in passing.items() if not passes}
    assert named("multipart-readings") == named("multipart-dynamics") == named("multipart-table-1")
    rows = {row["name"]: row for row in log.to_dict("records")}
    again = [
        row["name"]
        for sequence in drawing.SEQUENCES
        for light in drawing.LIGHTS
        for row in drawing.drawn(sequence, light, rows.__getitem__)
    ]
    assert again == list(log["name"])
    name = "multipart/8:light=dappled:scene=22"
    assert datasets.load("multipart/8:scene=22:light=dappled").name == name
    assert datasets.load(name).fingerprint == rows[name]["fingerprint"]
