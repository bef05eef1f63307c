"""Tiny paper with two trackers and twelve short scenes, and its stored runs."""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

from tests.bench.papers.claim_entries import claim_text
from tests.bench.stored_truths import add_truth_of
from trackmark import datasets
from trackmark.bench import papers as papers_package
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import ReproductionOptions, cases, paper
from trackmark.bench.papers.measures import find_measure
from trackmark.bench.papers.plan import experiments
from trackmark.bench.papers.reproduction import make_report
from trackmark.bench.store.run_store import RunStore
from trackmark.trackers.camshift import CamShift

SCENES = (200, *range(202, 213))  # of `plain/target`; scene 201 fails a criterion

FILES = {
    "paper.toml": """
version = 1
title = "A tiny paper"
citation = "A. Author. *A tiny paper.* 2001."
method = "CamShift on short sequences."
finding = "CamShift keeps the target."
quick_scenes = 2
frames_from = 1
pictures = "figure-1"

[[chain]]
parameter = "window"
as_written = "fixed"
recommended = "adaptive"
trackers = "camshift"
reason = "the paper's reference [1]"

[trackers]
camshift = "camshift"
static = "static:preset=recommended"

[sequences]
target = "plain/target:length=20"
twice = ["plain/target:length=20", "plain/target:length=20"]

[main_table]
caption = "Table 1 of the paper."
headings = ["statement", "tracker"]

[[main_table.rows]]
labels = ["target kept", "static"]
paper = "1 of 1"
sequence = "target"
trackers = "static"
claims = "TI-2"
measures = "kept_to_end"

[[main_table.rows]]
labels = ["frames tracked", "camshift / static"]
paper = "20 / 3 of 20"
sequence = "target"
trackers = ["camshift", "static"]
measures = "frames_on_target"
total = 20

[[main_table.rows]]
labels = ["smaller error", "camshift against static"]
paper = "–"
sequence = "target"
trackers = ["camshift", "static"]
measures = "mean_error"
compares = true

[figure.figure-1]
caption = "Frames 1, 10 and 20 with both trackers."
sequence = "target"
trackers = ["camshift", "static"]
frames = [1, 10, 20]

[figure.figure-2]
caption = "Error of both trackers by frame."
sequence = "target"
trackers = ["camshift", "static"]
quantity = "error"

[figure.figure-10]
caption = { figure-10 = "Two frames.", figure-10-later = "The later frame." }
description = "Frames 1 and 10 of scene 200."
function = "figures.two_frames"
""",
    "claims.toml": claim_text(
        "TI-1",
        sequences="target",
        better="camshift",
        worse="static",
        measure="mean_error",
        test="order",
        margin=0.25,
        scenes=12,
    )
    + claim_text(
        "TI-2",
        sequences="target",
        trackers="static",
        test="share",
        scenes=12,
    )
    + claim_text("TI-3", sequences="target", trackers="camshift", test="share", scenes=12),
    "timing.py": '''
"""Times that are made up."""

from trackmark.reports.tables import text_table


def time_table(context):
    return text_table("times", "Times.", ["tracker", "ours [ms]"], [["camshift", "2.0"]], 1)
''',
    "figures.py": '''
"""A figure of the paper's own."""

from trackmark import datasets


def two_frames(context):
    sequence = datasets.load("plain/target:length=20:scene=200")
    return {"figure-10": sequence[0], "figure-10-later": sequence[9]}
''',
    "sensitivity.toml": """
scenes = 2
columns = [
    { heading = "error", sequence = "target", tracker = "camshift", measure = "mean_error" },
    { heading = "kept of 2", sequence = "twice", tracker = "camshift", measure = "kept_to_end" }]
rows = ["16 bins"]
""",
    "development.toml": """
measure = "on_target"
heading = "share of frames on target"
runs = [{ tracker = "camshift", sequences = "target" }]
candidates = [{ name = "16 bins", changed_options = { camshift = "hue_bins=16" } }]
""",
    "development.csv": (
        "data,sequence,tracker,variant,measure,value,n,reference,difference,low,high,decision\n"
        "scenes,all,camshift,16 bins,on_target,0.75,12,recommended,0.25,0.125,0.375,better\n"
    ),
    "notes.md": """
## What differs and why

- The window.

## Decided after results had been seen

- The length of the scenes.

## Statements that are not judged

- The tracker is easy to use: not measured.

## History

- One scene was replaced.
""",
    "criteria.toml": """
first_scene = { "plain/target" = 200 }

[[criterion]]
sequence = "plain/target"
name = "speed [px]"
kind = "situation"
measure = "median_speed"
target = ">= 1"
sentence = "a moving target"
""",
    "criteria.csv": "sequence,scene,name,value,passes\n"
    + "".join(
        f"plain/target,{scene},speed [px],2,{'yes' if scene in SCENES else 'no'}\n"
        for scene in range(200, 213)
    ),
}


def stored_runs(folder, trackers, sequences):
    """Run trackers in this process, store their runs as an experiment and return the run keys."""
    results, versions = RunStore(folder), {}
    entries = [(parse_tracker(text), 0) for text in trackers]
    for sequence in map(datasets.load, sequences):
        add_truth_of(folder, sequence)
        for run in run_protocol(entries, sequence).runs:
            assert results.add(run)
            key = run.identity
            versions[key.tracker, key.sequence, key.repetition, key.protocol] = key.version
    results.add_requests(versions, folder.name)
    return set(versions)


@dataclass(frozen=True)
class Tiny:
    """The tiny paper with its stored runs; `folder` holds its files, `results` its experiments."""

    folder: Path
    results: Path

    @cached_property
    def paper(self):
        """The content of its files."""
        return paper.read_paper("tiny")

    @cached_property
    def requested(self):
        """Keys of the runs of all experiments, by experiment."""
        return {
            experiment.name: stored_runs(
                self.results / experiment.name,
                experiment.trackers,
                [source.spec for source in experiment.sequences],
            )
            for experiment in experiments(self.paper, ReproductionOptions(with_sensitivity=True))
        }

    def report(self, **options):
        """Return a report; its figures lie in `results / "tiny"`."""
        options = ReproductionOptions(jobs=1, **options)
        folder = self.results / "tiny"
        return make_report(self.paper, self.results, folder, options, self.requested)


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """Install the tiny paper as the only paper during the tests of a module."""
    papers = tmp_path_factory.mktemp("papers")
    for name, text in FILES.items():
        (papers / "tiny" / name).parent.mkdir(exist_ok=True)
        (papers / "tiny" / name).write_text(text)
    presets = {"as-written": {"window": "fixed"}, "recommended": {"window": "adaptive"}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CamShift, "presets", presets)
        patch.setattr(papers_package, "FOLDER", papers)
        patch.setattr(papers_package, "__path__", [*papers_package.__path__, str(papers)])
        patch.setattr(paper, "MAIN_SCENES", len(SCENES))
        yield Tiny(papers / "tiny", tmp_path_factory.mktemp("results"))
    for name in [name for name in sys.modules if name.startswith("trackmark.bench.papers.tiny")]:
        del sys.modules[name]
    for cached in (find_measure, cases.verdict_scenes):
        cached.cache_clear()


@pytest.fixture(scope="module")
def report(tiny):
    """Return the report of the tiny paper with everything."""
    return tiny.report(with_sensitivity=True)
