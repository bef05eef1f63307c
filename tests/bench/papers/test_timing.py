"""Methods that take turns: what a round tells, what is kept, and how trackers stand beside."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.experiments.contestant import contestant
from bench.papers import timing
from bench.papers.context import part_of
from bench.papers.nummiaro2003 import figures as nummiaro2003_figures
from bench.papers.timing import ROUNDS, geometric_mean, kept_times, tracker_times, turn_times

IMAGES = [np.full((2, 2, 3), shade, np.uint8) for shade in range(9)]
BOX = np.array([0.0, 0.0, 1.0, 1.0])


class Clock:
    """CPU time that runs on as methods say; now and then other load adds to it."""

    now, asked = 0.0, 0

    @classmethod
    def spend(cls, seconds):
        cls.asked += 1
        cls.now += seconds * (1.7 if cls.asked % 211 == 0 else 1.0)


class Method:
    """An update costs so many seconds, and more in the course of the clip."""

    def __init__(self, seconds=0.5e-3):
        self.seconds = seconds

    def init(self, image, box):
        self.shown = [image[0, 0, 0]]

    def update(self, image):
        assert image[0, 0, 0] == self.shown[-1] + 1
        self.shown.append(image[0, 0, 0])
        Clock.spend(self.seconds * (2 if len(self.shown) > 5 else 1))


@pytest.fixture
def clock(monkeypatch):
    monkeypatch.setattr(timing, "thread_time", lambda: Clock.now)
    monkeypatch.setattr(timing, "Reference", Method)


def test_methods_take_turns_and_load_that_comes_and_goes_changes_no_ratio(clock):
    clips = {"long": (IMAGES, BOX), "short": (IMAGES[:5], BOX)}
    methods = {"cheap": lambda: Method(1e-3), "dear": lambda: Method(3e-3)}
    times = turn_times(methods, clips)
    assert times["sequence"].tolist() == ["long"] * ROUNDS + ["short"] * ROUNDS
    assert times["round"].tolist() == [*range(ROUNDS)] * 2
    assert times["cheap"].to_numpy() == pytest.approx(np.repeat([1.5e-3, 1e-3], ROUNDS))
    assert times["reference"].to_numpy() == pytest.approx(times["cheap"] / 2)
    found = geometric_mean(times["dear"] / times["cheap"])
    assert list(found.values()) == pytest.approx([3, 3, 3])


def test_a_ratio_has_an_interval():
    found = geometric_mean([1.0, 2.0, 4.0] * 4)
    assert found["ratio"] == pytest.approx(2)
    assert 1 < found["low"] < 2 < found["high"] < 4
    assert found["low"] * found["high"] == pytest.approx(4)


NAME = "plain/target:length=20"
measured = []


def loud(names, frames, *texts):
    measured.append((names, frames, texts))
    return pd.DataFrame({"one": [1.0] * 4, "reference": [1.0, 1.2, 1.2, 1.3]})


def quiet(names, frames, *texts):
    return loud(names, frames, *texts).assign(reference=[1.0, 1.05, 1.1, 3.0])


def test_times_of_a_quiet_machine_are_kept_until_what_is_timed_changes(tmp_path, monkeypatch):
    measured.clear()
    context = SimpleNamespace(folder=tmp_path)

    def times(measure=quiet, names=(NAME,), texts=()):
        kept_times(context, measure, names, *texts, frames=30)
        return len(measured)

    assert [times(loud), times(loud)] == [1, 2]
    assert [times(), times()] == [3, 3]
    assert [times(texts=["static"]), times(texts=["static"])] == [4, 4]
    assert measured[-1] == ((NAME,), 30, ("static",))
    assert times(names=("plain/target:length=21",)) == 5
    monkeypatch.setattr(timing, "source_digest", lambda file, package: ("other", {}))
    assert times() == 6
    monkeypatch.setattr(timing.platform, "node", lambda: "another")
    assert [times(), times()] == [7, 7]


def test_trackers_of_a_timing_experiment_are_set_beside_its_first(tmp_path, monkeypatch, clock):
    texts = ("camshift", "camshift:window=adaptive")
    labels = [contestant(text).label for text in texts]
    monkeypatch.setattr(
        timing, "read_experiment", lambda name: SimpleNamespace(trackers=texts, name=name)
    )
    runs = pd.DataFrame(
        {"tracker": labels[0], "sequence": NAME, "disturbed": load}
        | {"seconds": seconds, "decoded": 2 * seconds}
        for seconds, load in ((1.0, 0), (3.0, 0), (8.0, 0), (9.0, 1), (9.0, 1), (9.0, 1))
    )
    monkeypatch.setattr(timing, "frame_times", lambda *_: runs)
    rounds = pd.DataFrame({labels[0]: 1.0, labels[1]: [2.0] * 12, "reference": [1.0] * 11 + [1.5]})
    monkeypatch.setattr(timing, "times_of_trackers", lambda names, frames, *texts: rounds)
    monkeypatch.setattr(timing, "kept_times", lambda _, measure, names, *texts, frames: rounds)
    context = SimpleNamespace(
        description=SimpleNamespace(experiment=str),
        results=tmp_path,
        asked={"time": {(label, NAME, 0, "timing") for label in labels}},
    )
    first, second = tracker_times(context, "time").to_dict("records")
    assert (first["tracker"], first["text"], first["sequence"]) == ("camshift", labels[0], NAME)
    assert (first["seconds"], first["decoded"], first["ratio"]) == (3.0, 6.0, pytest.approx(1))
    assert np.isnan(second["seconds"])
    assert second["ratio"] == pytest.approx(2)
    assert (second["reference"], second["load"]) == (1.0, 1.5)


def test_trackers_take_turns_as_runs_begin():
    labels = [contestant(text).label for text in ("static", "camshift")]
    times = timing.times_of_trackers(["samples/bow-tie"], 4, "static", "camshift")
    assert (times[[*labels, "reference"]] > 0).all(axis=None)
    assert set(times["sequence"]) == {"samples/bow-tie"}


@pytest.mark.parametrize("paper", ["nguyen2002", "nummiaro2003"])
def test_a_look_without_timing_runs_has_no_times(paper):
    tables = part_of(paper, "tables", "timing")
    assert tables(SimpleNamespace(asked={}, results=Path())) == {}


def test_a_look_without_timing_runs_has_no_figure_of_times():
    assert nummiaro2003_figures.times(SimpleNamespace(tables={})) is None
