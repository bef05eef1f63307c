"""Baselines as files, and what a check makes of them."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import datasets
import trackers
from bench.commands._design import Bench
from bench.comparing.baseline import (
    Baseline,
    BaselineCell,
    BaselineError,
    baseline_path,
    lacking,
    read_baseline,
    surroundings,
    write_baseline,
)
from bench.comparing.checking import as_data, as_junit, check, table, wanted
from bench.experiments.experiment import SequenceSource
from bench.statistics.regression import Sample
from reports.renderers import to_markdown, to_text


def cell(mean=0.5, spread=0.0, n=1, boxes="b0", sequence="f0", source=None):
    scores = {name: Sample(mean, spread, n) for name in ("mean_overlap", "success_share")}
    scores["centre_error"] = Sample(10.0, spread, n)
    return BaselineCell(source or SequenceSource("s0"), sequence, boxes, scores)


def baseline(**cells):
    return Baseline(
        {"a:key=1": {"s0": cell(), **cells}}, {"a:key=1": "a.py:key=1"}, 0.05, surroundings()
    )


def test_it_is_read_as_it_was_written(tmp_path):
    video = SequenceSource("clips/cup.mp4", Path("cup.csv"))
    kept = baseline(**{"cup.mp4": cell(1 / 3, 0.0123456789, 7, source=video)})
    kept = kept.moved_on("a:key=1", kept, 'a "better" update', "2026-11-22")
    write_baseline(kept, tmp_path / "own.toml")
    read = read_baseline(tmp_path / "own.toml")
    assert read.cells["a:key=1"]["cup.mp4"].source == video
    assert read.cells["a:key=1"]["cup.mp4"].scores["mean_overlap"] == (0.333333, 0.0123457, 7)
    assert read.texts == {"a:key=1": "a.py:key=1"}
    assert read.accepted[0]["because"] == 'a "better" update'
    write_baseline(read, tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_bytes() == (tmp_path / "own.toml").read_bytes()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("format = 1", "format = 7"), "format 7"),
        (lambda text: text.replace("runs = 1", "runs = 0"), "no whole baseline"),
        (lambda text: text.replace("mean_overlap = [0.5, 0]", "mean_overlap = [nan, 0]"), "whole"),
        (lambda text: text.replace("[trackers", "[others"), "no whole baseline .KeyError"),
        (lambda text: text[:-5], "own.toml"),
    ],
)
def test_a_file_that_is_no_baseline_is_named(tmp_path, change, words):
    file = tmp_path / "own.toml"
    write_baseline(baseline(), file)
    file.write_text(change(file.read_text()))
    with pytest.raises(BaselineError, match=words):
        read_baseline(file)


def test_names_are_files_in_a_folder_of_their_own():
    assert baseline_path("own") == Path("baselines/own.toml")
    assert baseline_path("tests/own.toml") == Path("tests/own.toml")
    with pytest.raises(BaselineError, match="trackmark baseline"):
        read_baseline(Path("nowhere.toml"))


def test_same_boxes_are_identical_only_where_the_surroundings_are():
    before = baseline()
    assert check(before, baseline()).judgement.state == "identical"
    elsewhere = replace(baseline(), made_with=surroundings() | {"numpy": "9.9"})
    found = check(before, elsewhere)
    assert found.judgement.state == "changed, no worse"
    assert "numpy" in to_text(table(found))


def test_a_changed_sequence_is_an_error_and_never_a_pass():
    with pytest.raises(BaselineError, match="s0 is no longer the sequence"):
        check(baseline(), baseline(s0=cell(sequence="other")))
    with pytest.raises(BaselineError, match="not run on s1"):
        check(baseline(s1=cell()), baseline())


def test_the_worst_stands_first_in_every_format():
    before = baseline(s1=cell(0.6, 0.1, 10), s2=cell(0.7))
    after = baseline(s1=cell(0.58, 0.1, 10, boxes="b1"), s2=cell(0.5, boxes="b1"))
    found = check(before, after)
    told = as_data(found)
    assert told["verdict"] == "regression"
    assert [row["state"] for row in told["cells"]] == ["worse", "cannot tell", "identical"]
    assert to_text(table(found)).splitlines()[4].startswith("worse        a:key=1  s2")
    assert len(table(found).rows) == 2
    assert len(table(found, whole=True).rows) == 3
    assert "worse" in to_markdown(table(found))
    suite = ElementTree.fromstring(as_junit(found))
    assert (suite.get("failures"), suite.get("skipped")) == ("1", "1")
    # The baseline's ten runs can't show a drop of .05 at that spread, whatever is added.
    assert wanted(found) == {("a:key=1", "s1"): float("inf")}
    assert "1 cells can't be told however often they are run now" in to_text(table(found))


def test_what_cannot_be_told_is_no_pass_and_what_all_cells_show_is_a_failure():
    names = [f"s{n}" for n in range(1, 81)]
    before = baseline(**{name: cell(0.5, 0.1, 10) for name in names})
    for drop, verdict, failures in ((0.0, "cannot tell", 0), (0.02, "regression", 1)):
        after = {name: cell(0.5 - drop, 0.1, 10, boxes="b1") for name in names}
        found = check(before, baseline(**after))
        assert as_data(found)["verdict"] == verdict
        suite = ElementTree.fromstring(as_junit(found))
        assert (suite.get("failures"), suite.get("skipped")) == (str(failures), "80")
        assert len(suite.findall("testcase")) == int(suite.get("tests")) == 81 + failures


class Drawn(Bench):
    """Scores drawn about a mean a sequence; the stages and the budget are the commands' own."""

    def __init__(self, means, spread, generator, boxes):
        self.spread, self.generator, self.boxes = spread, generator, boxes
        self.means, self.values = means, {name: np.empty(0) for name in means}
        self._ends, self._pace = float("inf"), 0.0

    def run(self, design, detect):
        cells = {}
        for (_, name), n in design.items():
            more = self.generator.normal(self.means[name], self.spread, n - len(self.values[name]))
            values = self.values[name] = np.append(self.values[name], more)
            cells[name] = cell(values.mean(), values.std(ddof=1), n, self.boxes)
        return Baseline({"a": cells}, {"a": "a"}, detect, surroundings())

    def extended(self, design, asked):
        return self.extend(design, asked, self.run(design, 0.05), 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.03, 0.08])
def test_in_stages_drops_are_found_and_unchanged_trackers_pass(spread):
    rounds, found = 150, {0.0: 0, 0.05: 0}
    for drop in found:
        generator = np.random.default_rng(8)
        for _ in range(rounds):
            means = {f"s{n}": generator.uniform(0.3, 0.8) for n in range(8)}
            design = {("a", name): 5 for name in means}
            before = Drawn(means, spread, generator, "b0").extended(design, lacking)
            design = {
                ("a", name): kept.scores["mean_overlap"].n
                for name, kept in before.cells["a"].items()
            }
            dropped = {name: mean - drop * (name < "s3") for name, mean in means.items()}
            bench = Drawn(dropped, spread, generator, "b1")
            now = bench.extended(design, lambda now, before=before: wanted(check(before, now)))
            found[drop] += check(before, now).judgement.state == "worse"
    assert found[0.05] / rounds >= 0.8
    assert found[0.0] / rounds <= 0.06 + 0.03  # so few rounds tell no better


def test_our_own_baseline_has_every_tracker_and_preset_on_every_sequence():
    kept = read_baseline(Path(__file__).parents[2] / "baseline.toml")
    usable = [name for name in trackers.names() if not name.startswith("opencv-")]
    labels = {
        name if preset == "recommended" else f"{name}:preset={preset}"
        for name in usable
        for preset in trackers.describe(name)["presets"]
    }
    assert set(kept.cells) == labels | {"opencv-camshift", "opencv-mil"}  # whose presets are equal
    sequences = {tuple(cells) for cells in kept.cells.values()}
    assert len(sequences) == 1
    suites = {name.partition("/")[0] for name in next(iter(sequences))}
    known = {name.partition("/")[0] for name in datasets.names()}
    assert suites == known - {"stress"}  # whose scenes are the walkers of `multipart`
