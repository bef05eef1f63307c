"""Properties that every protocol must have."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.evaluation.walkers import Walker
from tests.bench.stored_truths import add_truth_of
from trackmark import datasets
from trackmark.bench import metrics, protocols
from trackmark.bench.analysis.by_metrics import metric_tables
from trackmark.bench.evaluation.ground_truth import segment_frames
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.evaluation.scoring import can_score, score_run
from trackmark.bench.execution.plan import RunStatus, make_plan, missing_tasks
from trackmark.bench.execution.task import Limits
from trackmark.bench.execution.worker import run_task
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.protocols import ProtocolError, parse_protocol
from trackmark.bench.store.database import run_key
from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.runs import Runs
from trackmark.trackers import Estimate

every_protocol = pytest.mark.parametrize("name", protocols.names())

DEFAULTS = {
    "anchors": {"spacing": 50},
    "long-term": {},
    "one-pass": {},
    "real-time": {"fps": 25.0, "update_seconds": ""},
    "sre": {"shift": 0.1, "scale": 0.1},
    "supervised": {"skip_frames": 5, "threshold": 0.0},
    "tre": {"starts": 20, "min_frames": 20},
}
"""Defaults of all parameters. Stored names omit defaults: changing one changes their meaning."""

REPEATABLE = {"real-time": "real-time:update_seconds=0.05/0.01"}
"""Texts of protocols that depend on measured times by default."""


class Confident(Walker):
    """Walker that reports a confidence."""

    def update(self, image):
        estimate = super().update(image)
        return Estimate(estimate.box, details=estimate.details, confidence=0.5)


def text_of(name):
    return REPEATABLE.get(name, name)


def runs_by(name, sequence, *makers):
    entries = [(parse_tracker(maker), 0) for maker in makers]
    return run_protocol(entries, sequence, parse_protocol(text_of(name)).key).runs


@pytest.fixture
def sequence(make_sequence):
    return make_sequence(n=70, absent=(0, 30, 31))


def test_protocols_are_found_by_file_and_keep_defaults():
    files = {path.stem for path in Path(protocols.__file__).parent.glob("*.py")} - {"__init__"}
    assert {name.replace("-", "_") for name in protocols.names()} == files
    assert {name: dict(parse_protocol(name)) for name in protocols.names()} == DEFAULTS
    assert [parse_protocol(name).key for name in protocols.names()] == protocols.names()


@every_protocol
def test_definition_of_protocol_is_complete(name):
    definition = protocols.describe_protocol(name)
    assert definition["name"] == name
    assert definition["summary"].endswith(".")
    assert len(definition["summary"]) < 80
    assert len(definition["definition"]) > 200
    assert all(parameter["meaning"] for parameter in definition["parameters"])
    assert can_score(definition["metrics"], parse_protocol(name).key)


def test_parameters_are_parsed_and_checked():
    protocol = parse_protocol(" supervised:threshold=0.10:skip_frames=5")
    assert (protocol.skip_frames, protocol.threshold, protocol.key) == (
        5,
        0.1,
        "supervised:threshold=0.1",
    )
    for text, words in {
        "supervise": r"Did you mean 'supervised'\?$",
        "tre:start=3": "Did you mean 'starts'",
        "tre:starts=0": "parameter starts=0",
        "tre:starts": "not key=value",
        "real-time:update_seconds=a": "could not convert",
        "real-time:update_seconds=-1": "numbers ≥ 0",
        "real-time:fps=nan": "fps",
    }.items():
        with pytest.raises(ProtocolError, match=words):
            parse_protocol(text)


@every_protocol
def test_rows_follow_segments_and_start_with_init_boxes(name, sequence):
    (run,) = runs_by(name, sequence, Confident)
    assert run.status == "finished"
    segments = segment_frames(parse_protocol(text_of(name)).key, sequence, "boxes")
    assert [frames.tolist() for frames in run.segments] == [frames.tolist() for frames in segments]
    assert len(run.boxes) == (sum(map(len, segments)) or len(sequence))
    row = 0
    for frames in segments or [np.arange(len(sequence))]:
        first = int(sequence.present[frames].argmax())
        assert np.isnan(run.boxes[row : row + first]).all()
        init_box, truth = run.boxes[row + first], sequence.boxes[frames[first]]
        assert np.abs(init_box - truth).max() <= 0.2 * truth[2:].max() + 1e-12
        assert np.isfinite(run.boxes[row + first : row + len(frames)]).all() or name == "supervised"
        row += len(frames)


@every_protocol
def test_run_is_repeatable_alone_and_next_to_others(name, sequence):
    (run,) = runs_by(name, sequence, Confident)
    _, in_company, _ = runs_by(name, sequence, lambda seed: Confident(seed), Confident, Walker)
    (other,) = runs_by(name, sequence, Walker)
    evaluated = evaluate_run(Confident, sequence, protocol=text_of(name))
    for again in (in_company, evaluated):
        np.testing.assert_array_equal(run.boxes, again.boxes)
        assert run.identity == again.identity != other.identity
    np.testing.assert_array_equal(run.details["brightness"], in_company.details["brightness"])


@every_protocol
def test_stored_run_is_read_back_unchanged(name, sequence, tmp_path):
    (run,) = runs_by(name, sequence, Confident)
    results = RunStore(tmp_path / "trial")
    results.add_requests({})
    assert results.add(run)
    read = results.read(run_key(run.identity))
    for frames, expected in zip(read.segments, run.segments, strict=True):
        np.testing.assert_array_equal(frames, expected)
    for column in ("boxes", "visible", "confidence", "states", "estimate_frames"):
        np.testing.assert_array_equal(getattr(read, column), getattr(run, column), column)
    assert read.identity == run.identity


@every_protocol
def test_presets_judge_their_protocols_and_refuse_others(name, sequence):
    (run,) = runs_by(name, sequence, Confident)
    for preset in metrics.names():
        if can_score(preset, run.identity.protocol):
            if (name, preset) != ("one-pass", "vot-supervised"):  # which may have failed
                judged = score_run(run, sequence, preset)
                assert list(judged.scores) == list(metrics.find_metrics(preset).metrics)
                assert len(judged.segment_results) == len(run.segments)
        else:
            with pytest.raises(
                ValueError, match=f"^{preset} cannot score runs of the protocol {name}"
            ):
                score_run(run, sequence, preset)


@every_protocol
def test_tracker_that_raises_fails_only_its_run(name, sequence):
    class Raises(Confident):
        def update(self, image):
            if len(self.shown) == 12:
                raise RuntimeError("no idea")
            return super().update(image)

    failed, other = runs_by(name, sequence, Raises, Confident)
    (alone,) = runs_by(name, sequence, Confident)
    assert "no idea" in failed.failure
    assert failed.boxes.shape == other.boxes.shape
    assert np.isnan(failed.boxes[-1]).all()
    np.testing.assert_array_equal(other.boxes, alone.boxes)


def test_runs_by_unknown_protocol_are_read_but_not_judged(sequence, tmp_path):
    (run,) = runs_by("one-pass", sequence, Walker)
    unknown = replace(run, identity=replace(run.identity, protocol="of-tomorrow:knob=1"))
    results = RunStore(tmp_path / "trial")
    results.add_requests({})
    add_truth_of(results.folder, sequence)
    results.add(unknown)
    (row,) = Runs.open(results.folder).stored_rows
    assert (row["protocol"], row["scores"]) == ("of-tomorrow:knob=1", {})
    (table,) = metric_tables(Runs.open(results.folder), ["native"]).tables
    assert any(
        "native cannot score runs of the protocol of-tomorrow" in note for note in table.notes
    )


def test_one_pass_keeps_its_first_identity_and_stored_name(sequence, tmp_path):
    (run,) = runs_by("one-pass", sequence, Walker)
    assert run.identity.protocol == "one-pass"
    assert run.identity == evaluate_run(Walker, sequence).identity
    assert run_key(run.identity) == ("Walker", "line", 0, "one-pass")
    others = {runs_by(name, sequence, Confident)[0].identity.version for name in protocols.names()}
    assert len(others) == len(protocols.names())


@every_protocol
def test_failed_run_has_rows_of_its_protocol(name, tmp_path, monkeypatch):
    source = SequenceSpec("plain/target:length=30")
    experiment = Experiment("trial", ("static",), (source,), protocol=text_of(name))
    results = RunStore(tmp_path / "trial")
    plan = make_plan(experiment, results)
    (task,) = missing_tasks(plan)
    add_truth_of(results.folder, datasets.load(source.spec))
    monkeypatch.setattr("trackmark.trackers.static.Static.update", None)
    (run,) = run_task(task, Limits())
    assert results.add(run)
    assert "NoneType" in run.failure
    assert run.identity == task.runs[0].identity
    assert len(run.boxes) == task.n_frames == (sum(map(len, run.segments)) or 30)
    assert make_plan(experiment, results).count(RunStatus.FAILED) == 1
    other = replace(experiment, protocol="tre:starts=2")
    assert make_plan(other, results).count(RunStatus.MISSING) == 1
