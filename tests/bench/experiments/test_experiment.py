"""Experiment files: sweeps, and messages for wrong content."""

from functools import cache
from pathlib import Path

import pytest

from trackmark import datasets
from trackmark.bench.execution.plan import PlannedSequence, make_plan
from trackmark.bench.experiments.experiment import (
    Experiment,
    ExperimentError,
    SequenceSpec,
    experiment_names,
    read_experiment,
)
from trackmark.bench.store.run_store import RunStore
from trackmark.datasets.catalogue import suites
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.suite import SyntheticSuite

GOOD = """
version = 1
title = "A title"
repetitions = 4
trackers = ["static", { name = "camshift", window = ["fixed", "adaptive"], hue_bins = 16 }]
sequences = ["samples/face", { name = "plain/target", scene = [0, 1], occlusion = [0, 0.5] }]
"""


def written(tmp_path, text):
    path = tmp_path / "trial.toml"
    path.write_text(text)
    return path


def test_lists_are_swept_in_their_order(tmp_path):
    experiment = read_experiment(written(tmp_path, GOOD))
    assert experiment.name == "trial"
    assert experiment.title == "A title"
    assert experiment.repetitions == 4
    assert experiment.trackers == (
        "static",
        "camshift:window=fixed:hue_bins=16",
        "camshift:window=adaptive:hue_bins=16",
    )
    assert [source.spec for source in experiment.sequences] == [
        "samples/face",
        "plain/target:scene=0:occlusion=0",
        "plain/target:scene=0:occlusion=0.5",
        "plain/target:scene=1:occlusion=0",
        "plain/target:scene=1:occlusion=0.5",
    ]


def test_names_are_swept_and_trackers_may_have_own_repetitions(tmp_path):
    entry = '{ name = ["static", "camshift"], init = ["full", "boxes"], repetitions = 2 }'
    path = written(tmp_path, GOOD.replace('"static"', entry))
    experiment = read_experiment(path)
    special = ("static:init=full", "static:init=boxes", "camshift:init=full", "camshift:init=boxes")
    assert experiment.trackers[:4] == special
    assert experiment.repetitions_by_tracker == dict.fromkeys(special, 2)


def test_table_may_name_a_ground_truth_file(tmp_path):
    entry = '{ name = "a.mp4", truth = "b.csv" }'
    path = written(tmp_path, GOOD.replace('"samples/face"', entry))
    source = read_experiment(path).sequences[0]
    assert (source.spec, str(source.truth)) == ("a.mp4", "b.csv")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("hue_bins = 16", "hue_bins = []"), "contains an empty list"),
        (("version = 1", ""), "'version' is missing"),
        (("version = 1", "version = 2"), "version 2 is not"),
        (("version = 1", "version = true"), "version must be of type int"),
        (('title = "A title"', "titel = 3"), "unknown key 'titel'"),
        (("repetitions = 4", 'repetitions = "4"'), "repetitions must be of type int"),
        (("repetitions = 4", "repetitions = 0"), "repetitions: 0"),
        (('["static", ', '["static", "static", '), "'static' is named twice"),
        (('["static", ', "[7, "), "7 is neither a text nor a table"),
        (("version = 1", "version = = 1"), "trial.toml"),
        (('"static"', '{ name = "static", repetitions = "3" }'), "repetitions must be an integer"),
    ],
)
def test_mistake_is_named_with_file_and_key(tmp_path, change, words):
    assert change[0] in GOOD
    path = written(tmp_path, GOOD.replace(*change))
    with pytest.raises(ExperimentError) as caught:
        read_experiment(path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert "trial" in str(caught.value)


def test_unknown_experiment_and_invalid_name_are_refused(tmp_path):
    with pytest.raises(ExperimentError, match=r"nothing\.toml: No such file"):
        read_experiment(tmp_path / "nothing.toml")
    with pytest.raises(ExperimentError, match=r"Did you mean 'demo'\?"):
        read_experiment("dmo")
    for name in ("", " ", "a/b", ".hidden", "_truth", "own ", "a\nb"):
        with pytest.raises(ExperimentError, match="not a valid name of a results folder"):
            Experiment(name, ("static",), (SequenceSpec("samples/face"),))


outline = cache(datasets.describe)


def unopened(source):
    """Return the plan of a sequence from its sealed outline; its parameters are checked."""
    name, options = parse_text(source.spec)
    about = outline(name)
    for suite in suites():
        if name in suite.names() and isinstance(suite, SyntheticSuite):
            name = suite.entries[name].parameters.checked(name, options).canonical_name(name)
    starts = frozenset(["boxes", *about.regions])
    return PlannedSequence(source, name, about.fingerprint, about.length, (), starts)


@pytest.mark.parametrize("name", experiment_names())
def test_every_experiment_of_the_package_is_planned(name, tmp_path):
    experiment = read_experiment(name)
    opened_sequences = {(s, "one-pass"): unopened(s) for s in experiment.sequences}
    plan = make_plan(experiment, RunStore(tmp_path / "none"), opened_sequences)
    assert len(plan) == len(set(plan.requested)) > 0


def test_absolute_source_keeps_built_in_names(tmp_path, monkeypatch):
    (tmp_path / "samples" / "face").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    assert SequenceSpec("samples/face").absolute() == SequenceSpec("samples/face")
    assert SequenceSpec("./samples/face").absolute().spec == str(tmp_path / "samples" / "face")
    truth = SequenceSpec("clip.avi", Path("truth.csv")).absolute().truth
    assert truth == tmp_path / "truth.csv"
