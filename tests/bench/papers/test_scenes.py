"""What is measured on which scene, and how it is kept."""

import numpy as np
import pandas as pd
import pytest

import datasets
from bench.evaluation.timing import Remembered
from bench.papers import scenes
from bench.papers.scenes import (
    SceneCheck,
    measured_on_scenes,
    short_runs,
    with_contrast,
    with_gain,
    with_noise,
)
from datasets import Sequence, SequenceError

TARGET = "plain/target"
asked = []


def always(sequence, quick):
    asked.append((sequence.name, "always", quick))
    rows = pd.DataFrame({"value": [float(len(sequence)), np.nan]})
    return {"always": rows, "never": rows[:0]}


def further(sequence, quick):
    asked.append((sequence.name, "further", quick))
    return {"further": pd.DataFrame({"value": [1.0]})}


CHECKS = (
    SceneCheck(always, (TARGET,)),
    SceneCheck(further, (TARGET,), everything=True),
    SceneCheck(further, ("multipart/1",)),
)


@pytest.fixture
def measure(monkeypatch, tmp_path):
    """Measures in this process."""
    asked.clear()

    def here(function, names, jobs, title):
        return [(one, function(one)) for one in names]

    monkeypatch.setattr(scenes, "examined", here)

    def measure(*names, **options):
        return measured_on_scenes(CHECKS, scenes.PACKAGE / "a.py", names, tmp_path, 1, **options)

    monkeypatch.setattr(scenes, "source_digest", lambda file, package: (str(file), {}))
    return measure


def test_rows_say_what_scene_they_are_of_and_tables_without_rows_are_left_out(measure):
    tables = measure(f"{TARGET}:scene=3", TARGET)
    assert set(tables) == {"always"}
    rows = tables["always"]
    assert list(rows) == ["name", "sequence", "scene", "value"]
    assert rows["scene"].tolist() == [3, 3, 0, 0]
    assert set(rows["sequence"]) == {TARGET}
    assert rows["value"].isna().tolist() == [False, True] * 2


def test_what_was_measured_is_looked_up_and_everything_adds_to_it(measure, monkeypatch):
    measure(TARGET)
    measure(TARGET)
    assert asked == [(TARGET, "always", False)]
    assert set(measure(TARGET, everything=True)) == {"always", "further"}
    assert asked[1:] == [(TARGET, "further", False)]
    measure(TARGET, quick=True)
    assert asked[2:] == [(TARGET, "always", True)]
    monkeypatch.setattr(scenes, "source_digest", lambda file, package: ("other", {}))
    measure(TARGET)
    assert asked[3:] == [(TARGET, "always", False)]


def test_nothing_is_measured_where_no_check_belongs(measure):
    assert measure("multipart/2") == {}
    assert asked == []


def test_frames_are_rendered_once():
    class Counted(list):
        def __getitem__(self, frame):
            asked.append(frame)
            return super().__getitem__(frame)

    asked.clear()
    frames = Remembered(Counted([np.zeros((2, 2, 3), np.uint8)] * 3))
    assert frames[1] is frames[1]
    assert len(frames) == 3
    assert asked == [1]


def test_a_tracker_that_fails_is_named():
    part = datasets.load(f"{TARGET}:length=20")[:2]
    outside = Sequence("broken", list(part), [[-19.6, 50, 20, 20]] * 2, fingerprint="b")
    with pytest.raises(SequenceError, match=r"broken: camshift failed: .*no pixel"):
        short_runs(outside, ["camshift"])
    (run,) = short_runs(part, ["static"])
    assert run.boxes[1].tolist() == part.boxes[0].tolist()


def test_views_are_cut_off_where_the_cameras_range_ends():
    image = np.full((50, 50, 3), 200, np.uint8)
    assert (with_gain(image, 0.5) == 100).all()
    assert (with_gain(image, 2) == 255).all()
    assert (with_contrast(image, 0.5) == 164).all()
    noisy = with_noise(image, 4.0, np.random.default_rng(0)).astype(float)
    assert noisy.std() == pytest.approx(4.0, rel=0.05)
