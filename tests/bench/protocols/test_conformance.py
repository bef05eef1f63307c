"""What every protocol must do, whatever it is: asked of all that are found."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.bench.evaluation.walkers import Walker
from trackmark import bench, datasets
from trackmark.bench import metrics, protocols
from trackmark.bench.engine.work_unit import Failure
from trackmark.bench.engine.worker import record_failure
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.recorder import frames_of_segments
from trackmark.bench.evaluation.scoring import can_judge, judge
from trackmark.bench.execution.plan import State, make_plan
from trackmark.bench.execution.scheduling import left_of
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.protocols import STORED_ONE_PASS, ProtocolError, parse_protocol
from trackmark.bench.reporting.by_preset import preset_report
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.index import read_index
from trackmark.bench.store.layout import cell_of
from trackmark.bench.store.results import Results
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
"""A run's name says nothing of a knob at its default: who changes one, changes what is stored."""

REPEATABLE = {"real-time": "real-time:seconds=0.05/0.01"}
"""Texts of protocols that depend on the clock otherwise."""


class Sure(Walker):
    """Walks, and says how sure it is."""

    def update(self, image):
        said = super().update(image)
        return Estimate(said.box, details=said.details, confidence=0.5)


def text_of(name):
    return REPEATABLE.get(name, name)


def by(name, sequence, *makers):
    entries = [(parse_tracker(maker), 0) for maker in makers]
    return run_protocol(entries, sequence, parse_protocol(text_of(name)).text).runs


@pytest.fixture
def sequence(make_sequence):
    return make_sequence(n=70, absent=(0, 30, 31))


def test_a_protocol_is_found_by_its_file_and_defaults_stay():
    files = {path.stem for path in Path(protocols.__file__).parent.glob("*.py")} - {"__init__"}
    assert {name.replace("-", "_") for name in protocols.names()} == files
    assert {name: dict(parse_protocol(name)) for name in protocols.names()} == DEFAULTS


@every_protocol
def test_a_protocol_says_what_it_is(name):
    told = protocols.definition(name)
    assert told["name"] == name
    assert told["summary"].endswith(".")
    assert len(told["summary"]) < 80
    assert len(told["definition"]) > 200
    assert all(knob["meaning"] for knob in told["knobs"])
    assert can_judge(told["preset"], parse_protocol(name).text)


@every_protocol
def test_its_text_gives_it_again_and_names_what_differs_from_the_defaults(name):
    one = parse_protocol(name)
    assert one.text == (STORED_ONE_PASS if name == "one-pass" else name)
    assert parse_protocol(one.text) == one
    assert protocols.title(one.text) == name


def test_knobs_are_read_checked_and_named():
    one = parse_protocol(" supervised:threshold=0.10:skip=5")
    assert (one.skip, one.threshold, one.text) == (5, 0.1, "supervised:threshold=0.1")
    for text, words in {
        "supervise": r"Did you mean 'supervised'\? Known: anchors, ",
        "tre:start=3": "Did you mean 'starts'",
        "tre:starts=0": "parameter starts=0",
        "tre:starts": "not key=value",
        "real-time:seconds=a": "could not convert",
        "real-time:seconds=-1": "numbers of 0 or more",
        "real-time:fps=nan": "fps",
    }.items():
        with pytest.raises(ProtocolError, match=words):
            parse_protocol(text)


@every_protocol
def test_rows_are_those_of_the_segments_and_each_begins_with_a_given_box(name, sequence):
    (run,) = by(name, sequence, Sure)
    assert run.status == "finished"
    segments = frames_of_segments(parse_protocol(text_of(name)).text, sequence, "boxes")
    assert [of.tolist() for of in run.segments] == [of.tolist() for of in segments]
    assert len(run.boxes) == (sum(map(len, segments)) or len(sequence))
    at = 0
    for frames in segments or [np.arange(len(sequence))]:
        first = int(sequence.present[frames].argmax())
        assert np.isnan(run.boxes[at : at + first]).all()
        given, truth = run.boxes[at + first], sequence.boxes[frames[first]]
        assert np.abs(given - truth).max() <= 0.2 * truth[2:].max() + 1e-12
        assert np.isfinite(run.boxes[at + first : at + len(frames)]).all() or name == "supervised"
        at += len(frames)


@every_protocol
def test_run_is_repeatable_alone_and_next_to_others(name, sequence):
    (run,) = by(name, sequence, Sure)
    _, beside, _ = by(name, sequence, lambda seed: Sure(seed), Sure, Walker)
    (other,) = by(name, sequence, Walker)
    evaluated = bench.evaluate(Sure, sequence, protocol=text_of(name))
    for again in (beside, evaluated):
        np.testing.assert_array_equal(run.boxes, again.boxes)
        assert run.identity == again.identity != other.identity
    np.testing.assert_array_equal(run.details["brightness"], beside.details["brightness"])


@every_protocol
def test_what_is_stored_is_read_as_it_was(name, sequence, tmp_path):
    (run,) = by(name, sequence, Sure)
    results = Results(tmp_path / "trial")
    results.prepare(Asked("", {}))
    assert results.write(run)
    read = results.read(cell_of(run.identity))
    for found, made in zip(read.segments, run.segments, strict=True):
        np.testing.assert_array_equal(found, made)
    for column in ("boxes", "visible", "confidence", "states", "answered"):
        np.testing.assert_array_equal(getattr(read, column), getattr(run, column), column)
    assert read.identity == run.identity


@every_protocol
def test_presets_judge_what_the_protocol_is_for_and_refuse_the_rest_by_name(name, sequence):
    (run,) = by(name, sequence, Sure)
    for preset in metrics.preset_names():
        if can_judge(preset, run.identity.protocol):
            if (name, preset) != ("one-pass", "vot-supervised"):  # which may have failed
                judged = judge(run, sequence, preset)
                assert list(judged.scores) == list(metrics.preset(preset).columns)
                assert len(judged.parts) == len(run.segments)
        else:
            with pytest.raises(
                ValueError, match=f"^{preset} judges no runs by the protocol {name}"
            ):
                judge(run, sequence, preset)


@every_protocol
def test_a_tracker_that_raises_fails_its_run_alone(name, sequence):
    class Raises(Sure):
        def update(self, image):
            if len(self.shown) == 12:
                raise RuntimeError("no idea")
            return super().update(image)

    failed, other = by(name, sequence, Raises, Sure)
    (alone,) = by(name, sequence, Sure)
    assert "no idea" in failed.failure
    assert failed.boxes.shape == other.boxes.shape
    assert np.isnan(failed.boxes[-1]).all()
    np.testing.assert_array_equal(other.boxes, alone.boxes)


def test_runs_by_a_protocol_that_is_not_known_here_are_read_and_not_judged(sequence, tmp_path):
    (run,) = by("one-pass", sequence, Walker)
    strange = replace(run, identity=replace(run.identity, protocol="of-tomorrow:knob=1"))
    results = Results(tmp_path / "trial")
    results.prepare(Asked("", {}))
    write_truth(results.folder, sequence)
    results.write(strange)
    (row,) = read_index(results)
    assert (row["protocol"], row["scores"]) == ("of-tomorrow:knob=1", {})
    (table,) = preset_report(results.folder, ["native"]).tables
    assert any("native judges no runs by the protocol of-tomorrow" in note for note in table.notes)


def test_one_pass_is_identified_and_filed_as_before_there_were_others(sequence, tmp_path):
    (run,) = by("one-pass", sequence, Walker)
    assert run.identity.protocol == "accuracy"
    assert run.identity == bench.evaluate(Walker, sequence).identity
    assert cell_of(run.identity) == ("Walker", "line", 0, "accuracy")
    others = {by(name, sequence, Sure)[0].identity.version for name in protocols.names()}
    assert len(others) == len(protocols.names())


@every_protocol
def test_a_run_whose_process_died_is_recorded_with_the_rows_of_its_protocol(name, tmp_path):
    source = SequenceSource("plain/target:length=30")
    asked = Experiment("trial", ("static",), (source,), protocol=text_of(name))
    results = Results(tmp_path / "trial")
    plan = make_plan(asked, results)
    (unit,) = left_of(plan)
    write_truth(results.folder, datasets.load(source.text))
    (run,) = record_failure(unit, Failure(3, "it died")).runs
    assert results.write(run)
    assert run.failure == "frame 3: it died"
    assert run.identity.version == unit.entries[0].version
    assert len(run.boxes) == unit.frames == (sum(map(len, run.segments)) or 30)
    assert make_plan(asked, results).count(State.FAILED) == 1
    assert make_plan(replace(asked, protocol="tre:starts=2"), results).count(State.LEFT) == 1
