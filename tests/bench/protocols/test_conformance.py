"""Properties that every protocol must have."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.evaluation.walkers import Walker
from trackmark import bench, datasets
from trackmark.bench import metrics, protocols
from trackmark.bench.analysis.by_metrics import preset_report
from trackmark.bench.engine.work_unit import Failure
from trackmark.bench.engine.worker import record_failure
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.recorder import segment_frames
from trackmark.bench.evaluation.scoring import can_score, score_run
from trackmark.bench.execution.plan import State, make_plan
from trackmark.bench.execution.scheduling import missing_units
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.protocols import STORED_ONE_PASS, ProtocolError, parse_protocol
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.manifest import Manifest
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_scored_runs
from trackmark.bench.store.truth import write_truth
from trackmark.trackers import Estimate

every_protocol = pytest.mark.parametrize("name", protocols.names())

DEFAULTS = {
    "anchors": {"spacing": 50},
    "long-term": {},
    "one-pass": {},
    "real-time": {"fps": 25.0, "seconds": ""},
    "sre": {"shift": 0.1, "scale": 0.1},
    "supervised": {"skip": 5, "threshold": 0.0},
    "tre": {"starts": 20, "least": 20},
}
"""Defaults of all parameters. Stored names omit defaults: changing one changes their meaning."""

REPEATABLE = {"real-time": "real-time:seconds=0.05/0.01"}
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
    return run_protocol(entries, sequence, parse_protocol(text_of(name)).text).runs


@pytest.fixture
def sequence(make_sequence):
    return make_sequence(n=70, absent=(0, 30, 31))


def test_protocols_are_found_by_file_and_keep_defaults():
    files = {path.stem for path in Path(protocols.__file__).parent.glob("*.py")} - {"__init__"}
    assert {name.replace("-", "_") for name in protocols.names()} == files
    assert {name: dict(parse_protocol(name)) for name in protocols.names()} == DEFAULTS


@every_protocol
def test_definition_of_protocol_is_complete(name):
    definition = protocols.definition(name)
    assert definition["name"] == name
    assert definition["summary"].endswith(".")
    assert len(definition["summary"]) < 80
    assert len(definition["definition"]) > 200
    assert all(parameter["meaning"] for parameter in definition["knobs"])
    assert can_score(definition["preset"], parse_protocol(name).text)


@every_protocol
def test_text_of_protocol_is_parsed_to_an_equal_protocol(name):
    protocol = parse_protocol(name)
    assert protocol.text == (STORED_ONE_PASS if name == "one-pass" else name)
    assert parse_protocol(protocol.text) == protocol
    assert protocols.title(protocol.text) == name


def test_parameters_are_parsed_and_checked():
    protocol = parse_protocol(" supervised:threshold=0.10:skip=5")
    assert (protocol.skip, protocol.threshold, protocol.text) == (
        5,
        0.1,
        "supervised:threshold=0.1",
    )
    for text, words in {
        "supervise": r"Did you mean 'supervised'\?$",
        "tre:start=3": "Did you mean 'starts'",
        "tre:starts=0": "parameter starts=0",
        "tre:starts": "not key=value",
        "real-time:seconds=a": "could not convert",
        "real-time:seconds=-1": "numbers ≥ 0",
        "real-time:fps=nan": "fps",
    }.items():
        with pytest.raises(ProtocolError, match=words):
            parse_protocol(text)


@every_protocol
def test_rows_follow_segments_and_start_with_init_boxes(name, sequence):
    (run,) = runs_by(name, sequence, Confident)
    assert run.status == "finished"
    segments = segment_frames(parse_protocol(text_of(name)).text, sequence, "boxes")
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
    evaluated = bench.evaluate_run(Confident, sequence, protocol=text_of(name))
    for again in (in_company, evaluated):
        np.testing.assert_array_equal(run.boxes, again.boxes)
        assert run.identity == again.identity != other.identity
    np.testing.assert_array_equal(run.details["brightness"], in_company.details["brightness"])


@every_protocol
def test_stored_run_is_read_back_unchanged(name, sequence, tmp_path):
    (run,) = runs_by(name, sequence, Confident)
    results = Results(tmp_path / "trial")
    results.prepare(Manifest("", {}))
    assert results.write(run)
    read = results.read(run_key(run.identity))
    for frames, expected in zip(read.segments, run.segments, strict=True):
        np.testing.assert_array_equal(frames, expected)
    for column in ("boxes", "visible", "confidence", "states", "source_frames"):
        np.testing.assert_array_equal(getattr(read, column), getattr(run, column), column)
    assert read.identity == run.identity


@every_protocol
def test_presets_judge_their_protocols_and_refuse_others(name, sequence):
    (run,) = runs_by(name, sequence, Confident)
    for preset in metrics.names():
        if can_score(preset, run.identity.protocol):
            if (name, preset) != ("one-pass", "vot-supervised"):  # which may have failed
                judged = score_run(run, sequence, preset)
                assert list(judged.scores) == list(metrics.preset(preset).columns)
                assert len(judged.parts) == len(run.segments)
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
    results = Results(tmp_path / "trial")
    results.prepare(Manifest("", {}))
    write_truth(results.folder, sequence)
    results.write(unknown)
    (row,) = list_scored_runs(results)
    assert (row["protocol"], row["scores"]) == ("of-tomorrow:knob=1", {})
    (table,) = preset_report(results.folder, ["native"]).tables
    assert any(
        "native cannot score runs of the protocol of-tomorrow" in note for note in table.notes
    )


def test_one_pass_keeps_its_first_identity_and_stored_name(sequence, tmp_path):
    (run,) = runs_by("one-pass", sequence, Walker)
    assert run.identity.protocol == "accuracy"
    assert run.identity == bench.evaluate_run(Walker, sequence).identity
    assert run_key(run.identity) == ("Walker", "line", 0, "accuracy")
    others = {runs_by(name, sequence, Confident)[0].identity.version for name in protocols.names()}
    assert len(others) == len(protocols.names())


@every_protocol
def test_run_of_dead_process_has_rows_of_its_protocol(name, tmp_path):
    source = SequenceSource("plain/target:length=30")
    experiment = Experiment("trial", ("static",), (source,), protocol=text_of(name))
    results = Results(tmp_path / "trial")
    plan = make_plan(experiment, results)
    (unit,) = missing_units(plan)
    write_truth(results.folder, datasets.load(source.text))
    run = record_failure(unit, Failure(3, "it died"))
    assert results.write(run)
    assert run.failure == "frame 3: it died"
    assert run.identity.version == unit.entries[0].version
    assert len(run.boxes) == unit.frames == (sum(map(len, run.segments)) or 30)
    assert make_plan(experiment, results).count(State.FAILED) == 1
    assert make_plan(replace(experiment, protocol="tre:starts=2"), results).count(State.LEFT) == 1
