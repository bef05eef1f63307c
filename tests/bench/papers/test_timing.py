"""Times of methods that take turns, and tables of times."""

import importlib
from types import SimpleNamespace

import numpy as np
import pytest

from trackmark.bench.evaluation import timed_clips
from trackmark.bench.papers import scene_values, timing
from trackmark.bench.papers.multipart import timing as multipart
from trackmark.bench.papers.nummiaro2003 import timing as nummiaro2003
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.timing import ROUNDS, open_excerpts, tracker_methods, turn_times
from trackmark.bench.papers.wang2010 import timing as wang2010

IMAGES = [np.full((2, 2, 3), shade, np.uint8) for shade in range(9)]
BOX = np.array([0.0, 0.0, 1.0, 1.0])
NAME = "plain/target:length=20"


class Load:
    """Simulated CPU time of methods, which other load sometimes increases."""

    now, calls = 0.0, 0
    reference = 1.0, 1.05, 1.1, 3.0  # the last time is of a machine under load

    @classmethod
    def spend(cls, seconds):
        cls.calls += 1
        cls.now += seconds * (1.7 if cls.calls % 211 == 0 else 1.0)


class Method:
    """Method whose updates take a known time, twice as long after the fourth image."""

    def __init__(self, seconds=0.5e-3):
        self.seconds = seconds

    def init(self, image, box):
        self.shades = [image[0, 0, 0]]

    def update(self, image):
        assert image[0, 0, 0] == self.shades[-1] + 1
        self.shades.append(image[0, 0, 0])
        Load.spend(self.seconds * (2 if len(self.shades) > 5 else 1))


def test_ratio_of_turns_ignores_other_load(monkeypatch):
    class Clock:
        def start(self):
            self.started = Load.now

        def stop(self):
            return timed_clips.TurnTime(Load.now - self.started, 0.0)

    monkeypatch.setattr(timed_clips, "CLOCK", Clock())
    monkeypatch.setattr(timing, "Reference", Method)
    excerpts = [("long", IMAGES, BOX), ("short", IMAGES[:5], BOX), ("short", IMAGES[:3], BOX)]
    times = turn_times({"fast": lambda: Method(1e-3), "slow": lambda: Method(3e-3)}, excerpts)
    assert list(times) == ["long", "short"]
    for name, seconds in (("long", 1.5e-3), ("short", 1e-3)):
        np.testing.assert_allclose(times[name]["fast"], np.full(ROUNDS, seconds))
        np.testing.assert_allclose(times[name]["slow"] / times[name]["fast"], 3)
        np.testing.assert_allclose(times[name]["reference"], times[name]["fast"] / 2)


@pytest.fixture
def ask(monkeypatch, tmp_path, without_processes):
    """Ask for the times of a tracker on a sequence; count measurements."""
    measured = []

    def measure_scenes(*arguments, **options):
        measured.append(arguments)
        return {"target": {"reference": np.array(Load.reference)}}

    monkeypatch.setattr(timing, "measure_scenes", measure_scenes)
    scenes = {"target": SimpleNamespace(scenes=lambda _: [(NAME,)])}
    paper = SimpleNamespace(spec=lambda tracker, setting: tracker, sequences=scenes)
    context = SimpleNamespace(paper=paper, folder=tmp_path)

    def times(tracker="static", frames=3):
        with without_processes():
            stored = timing.kept_times(context, tracker_methods, "", [tracker], ["target"], frames)
        np.testing.assert_array_equal(stored["target"]["reference"], Load.reference)
        return len(measured)

    return times


def test_times_are_stored_until_what_is_timed_changes(ask, monkeypatch):
    assert [ask(), ask()] == [1, 1]
    assert [ask("camshift"), ask("camshift"), ask(frames=4)] == [2, 2, 3]
    monkeypatch.setattr(scene_values, "source_digest", lambda file, package: ("other", {}))
    assert [ask(), ask()] == [4, 4]
    monkeypatch.setattr(Load, "reference", (1.0, 1.2, 1.2, 1.3))  # of a loaded machine
    assert [ask(frames=5), ask(frames=5)] == [5, 6]


@pytest.mark.parametrize(
    ("methods", "texts"),
    [
        (wang2010.plain_methods, ("wang2010", "particle-filter", "camshift", "camshift-improved")),
        (tracker_methods, ("camshift",)),
        (multipart.histograms, ("multipart",)),
        (nummiaro2003.numpy_methods, ("nummiaro2003:preset=as-written",)),
        (nummiaro2003.compiled_methods, ("nummiaro2003:preset=as-written",)),
    ],
)
def test_methods_of_papers_run(methods, texts):
    for make in methods(dict(zip(texts, texts, strict=True))).values():
        method = make()
        (_, images, box), *_ = open_excerpts("target", NAME, 2)
        method.init(images[0], box)
        for image in images[1:]:
            method.update(image)


def simulated_times(context, methods, setting, names, sequences, *_):
    """Return times of methods, which increase in the order of the methods."""
    texts = {name: context.paper.spec(name, setting) for name in names}
    return {
        sequence: {
            method: np.full(ROUNDS, 1e-3 * 1.6**number * (1 + place))
            for number, method in enumerate([*methods(texts), "reference"])
        }
        for place, sequence in enumerate(sequences)
    }


@pytest.mark.parametrize("paper", ["multipart", "nguyen2002", "nummiaro2003", "wang2010"])
def test_table_of_times_has_a_cell_per_heading(paper, monkeypatch):
    module = importlib.import_module(f"trackmark.bench.papers.{paper}.timing")
    monkeypatch.setattr(module, "kept_times", simulated_times)
    table = module.time_table(SimpleNamespace(paper=read_paper(paper)))
    assert table.rows
    assert {len(row) for row in table.rows} == {len(table.headings)}
