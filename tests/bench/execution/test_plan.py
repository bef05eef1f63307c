"""Tests of plans: finished runs, stale runs and the division of the rest into work units."""

import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import pytest

from trackmark import trackers
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.execution.plan import State, make_plan
from trackmark.bench.execution.scheduling import missing_units
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.store.results import Results
from trackmark.datasets import SequenceError

TINY = "plain/target:length=12:width=64:height=64"

pytestmark = pytest.mark.usefixtures("in_this_process")


def append(file, text):
    file.write_text(file.read_text() + text)


def experiment(workspace, **changes):
    settings = {
        "name": "trial",
        "trackers": ("static", f"{workspace / 'knob.py'}:Knob"),
        "sequences": (SequenceSource(str(workspace / "data" / "Small")),),
        "repetitions": 3,
    } | changes
    return Experiment(**settings)


def states(workspace, **changes):
    chosen = experiment(workspace, **changes)
    plan = make_plan(chosen, Results(workspace / "results" / chosen.name))
    run_states = zip(plan.manifest().versions, plan.states.ravel(), strict=True)
    return {
        (tracker, repetition): State(state).name.lower()
        for (tracker, _, repetition, _), state in run_states
    }


@pytest.fixture
def finished(workspace):
    run_experiment(experiment(workspace), workspace / "results", jobs=1)
    assert set(states(workspace).values()) == {"done"}
    return workspace


def test_tracker_can_have_its_own_number_of_repetitions(workspace):
    knob = f"{workspace / 'knob.py'}:Knob"
    assert len(states(workspace, repeated={knob: 1})) == 2


def test_disturbed_timing_runs_alone_are_measured_again(workspace, monkeypatch):
    run_experiment(experiment(workspace, timing=True), workspace / "results", jobs=1)
    monkeypatch.setattr("trackmark.bench.execution.plan.MAX_RUN_DELAY", -1.0)
    timed = experiment(workspace, timing=True)
    assert set(states(workspace, timing=True).values()) == {"disturbed"}
    plan = make_plan(timed, Results(workspace / "results" / timed.name))
    assert missing_units(plan).runs == len(plan)
    monkeypatch.setattr("trackmark.bench.execution.plan.MAX_RUN_DELAY", 1.0)
    assert set(states(workspace, timing=True).values()) == {"done"}


def test_missing_region_is_rejected_before_first_run(workspace):
    with pytest.raises(SequenceError, match="no region 'full'"):
        states(workspace, trackers=("static:init=full",))


def test_changed_shared_module_makes_runs_stale(finished, monkeypatch, tmp_path):
    copy = tmp_path / "copy" / "trackers"
    shutil.copytree(Path(trackers.__file__).parent, copy)
    monkeypatch.setattr("trackmark.bench.experiments.tracker_spec.PACKAGE", copy)
    assert states(finished)["knob.py:Knob", 0] == "done"
    interface = copy / "base" / "interface.py"
    append(interface, "CHANGED = True\n")
    assert states(finished)["knob.py:Knob", 0] == "stale"
    catalogue = copy / "base" / "catalogue.py"
    shutil.copy(Path(trackers.__file__).parent / "base" / "interface.py", interface)
    catalogue.write_text("NOTHING_DEPENDS_ON_THIS = True\n")
    assert states(finished)["knob.py:Knob", 0] == "done"


def change_a_pixel(data):
    file = data / "img" / "0003.png"
    image = cv2.imread(str(file))
    image[7, 9, 1] ^= 1
    cv2.imwrite(str(file), image)


def change_a_box(data):
    file = data / "groundtruth_rect.txt"
    file.write_text(file.read_text().replace("5,6,10,12", "5,6,10,13", 1))


def touch(data):
    for file in data.rglob("*.*"):
        file.touch()


@pytest.mark.parametrize(
    ("change", "state"), [(change_a_pixel, "stale"), (change_a_box, "stale"), (touch, "done")]
)
def test_changed_sequence_makes_runs_stale_but_mtime_does_not(finished, change, state):
    change(finished / "data" / "Small")
    assert set(states(finished).values()) == {state}


def test_timing_runs_are_runs_of_their_own(finished):
    timing = {"timing": True, "repetitions": 1}
    assert set(states(finished, **timing).values()) == {"left"}
    run_experiment(experiment(finished, **timing), finished / "results")
    assert set(states(finished, **timing).values()) == {"done"}
    assert set(states(finished).values()) == {"done"}


def test_external_and_timed_trackers_share_no_process(workspace):
    """Check that the runs of an external tracker are adjacent, so that they reuse its process."""
    (workspace / "Twin.py").write_text((workspace / "knob.py").read_text())
    texts = (
        "static",
        f"{workspace}/knob.py:Knob",
        "camshift",
        f"{workspace}/Twin.py:Knob",
        "opencv-mil",
    )
    plan = small_plan(workspace, 2, trackers=texts, repetitions=1)
    units = [
        (unit.owner, *(entry.tracker for entry in unit.entries)) for unit in missing_units(plan)
    ]
    knob, twin = ((f"{text.partition(':')[0]}:{Path(text).name}", text) for text in texts[1:4:2])
    mil, shared = ("", texts[4]), ("", texts[0], texts[2])
    assert units == [knob, knob, twin, twin, mil, mil, shared, shared]
    timed = small_plan(workspace, trackers=texts, repetitions=2, timing=True)
    owners = [unit.owner for unit in missing_units(timed)]
    assert len(owners) == 5 * 2 * 2
    assert len(set(owners)) == 5
    assert owners[:5] != owners[:1] * 5  # timed trackers take turns
    assert sorted(owners[:5]) == sorted(owners[5:10])


def test_equal_trackers_are_planned_once(workspace):
    chosen = ("camshift", "camshift:window=fixed", "camshift:hue_bins=32")
    assert list(states(workspace, trackers=chosen)) == [("camshift", 0)]


def test_two_sequences_of_one_name_are_refused(workspace):
    other = workspace / "other" / "Small"
    shutil.copytree(workspace / "data" / "Small", other)
    sources = tuple(SequenceSource(str(path)) for path in (workspace / "data" / "Small", other))
    assert len(states(workspace, sequences=sources)) == 4
    (other / "groundtruth_rect.txt").write_text("6,6,10,12\n" * 5)
    with pytest.raises(
        ExperimentError, match="two different sequences are called 'Small'"
    ) as raised:
        states(workspace, sequences=sources)
    assert f"{workspace / 'data' / 'Small'} and {other}. " in str(raised.value)


def test_two_trackers_of_one_name_are_refused(workspace):
    (workspace / "elsewhere").mkdir()
    shutil.copy(workspace / "knob.py", workspace / "elsewhere")
    both = tuple(f"{workspace / place / 'knob.py'}:Knob" for place in ("", "elsewhere"))
    with pytest.raises(
        ExperimentError, match=f"are called 'knob.py:Knob': {both[0]} and {both[1]}"
    ):
        states(workspace, trackers=both)


def test_failed_runs_are_repeated_only_on_request(workspace):
    file = workspace / "knob.py"
    file.write_text(file.read_text().replace("return Estimate", "raise ValueError  #"))
    run_experiment(experiment(workspace), workspace / "results")
    run_states = states(workspace)
    assert run_states["static", 0] == "done"
    assert run_states["knob.py:Knob", 1] == "failed"
    plan = make_plan(experiment(workspace), Results(workspace / "results" / "trial"))
    assert list(missing_units(plan)) == []
    (unit,) = missing_units(plan, retry_failed=True)
    assert len(unit.entries) == 3
    assert plan.count(State.FAILED) == 3


def small_plan(workspace, sequences=1, **changes):
    """Return a plan: on each sequence of five frames, 1 run of a tracker and 3 of another."""
    for i in range(1, sequences):
        shutil.copytree(workspace / "data" / "Small", workspace / "data" / f"Other{i}")
    sources = tuple(SequenceSource(str(path)) for path in sorted((workspace / "data").iterdir()))
    return make_plan(
        experiment(workspace, sequences=sources, **changes), Results(workspace / "none")
    )


@pytest.mark.parametrize("sequences", [1, 3])
@pytest.mark.parametrize("workers", [1, 2, 3, 5, 50])
def test_units_fit_worker_share_and_cover_every_run_once(workspace, sequences, workers):
    plan = small_plan(workspace, sequences)
    units = missing_units(plan, workers=workers)
    all_units = list(units)
    assert len(units) == len(all_units)
    assert units.runs == 4 * sequences == sum(len(unit.entries) for unit in all_units)
    assert units.work == sum(unit.work for unit in all_units) == 4 * 5 * sequences
    for unit in all_units:
        assert len(unit.entries) == 1 or unit.work * workers <= units.work
    runs = {(unit.source, *entry[:2]) for unit in all_units for entry in unit.entries}
    assert len(runs) == units.runs
    if sequences % workers == 0:
        assert len(all_units) == 2 * sequences, "two per sequence: static and the rest"
    # Distribute units as a pool does: no worker has more than its share and one run.
    busy = [0] * workers
    for unit in all_units:
        busy[busy.index(min(busy))] += unit.work
    assert max(busy) <= units.work / workers + 5


def test_longest_sequences_are_planned_first(workspace, otb):
    sources = [SequenceSource(str(workspace / "data" / "Small"))]
    sources.append(SequenceSource(str(otb(workspace / "data" / "Longer", 9))))
    plan = make_plan(experiment(workspace, sequences=tuple(sources)), Results(workspace / "none"))
    assert [unit.work for unit in missing_units(plan)] == [27, 15, 9, 5]


def test_unit_has_the_replaced_version_of_each_run(finished):
    before = make_plan(experiment(finished), Results(finished / "results" / "trial"))
    append(finished / "knob.py", "CHANGED = True\n")
    chosen = experiment(finished, repetitions=4)
    plan = make_plan(chosen, Results(finished / "results" / "trial"))
    (unit,) = missing_units(plan)
    old = before.versions[0][1]
    assert [entry.replaces for entry in unit.entries] == [old, old, old, ""]
    assert all(entry.version == plan.versions[0][1] != old for entry in unit.entries)


def test_opened_sequence_is_reused_by_next_plan(workspace, monkeypatch):
    opened_sequences = {}
    first = make_plan(experiment(workspace), Results(workspace / "none"), opened_sequences)
    monkeypatch.setattr(
        "trackmark.datasets.load", lambda *_, **__: pytest.fail("a sequence was opened")
    )
    second = make_plan(experiment(workspace), Results(workspace / "none"), opened_sequences)
    assert first.versions == second.versions


def test_workers_open_sequences_of_large_plan_equally(workspace, monkeypatch):
    sources = [SequenceSource(f"{TINY}:scene={scene}") for scene in range(12)]
    large = Experiment("large", ("static",), tuple(sources[:4]))
    results, progress = Results(workspace / "results" / "large"), []
    alone = make_plan(large, results)
    monkeypatch.setattr("trackmark.bench.execution.plan.MIN_SEQUENCES_FOR_WORKERS", 4)
    shared = make_plan(large, results, on_opened=lambda *number: progress.append(number), jobs=2)
    assert progress[:4] == [(number, 4) for number in range(4)]
    for field in ("name", "fingerprint", "frames", "starts"):
        assert [getattr(sequence, field) for sequence in shared.sequences] == [
            getattr(sequence, field) for sequence in alone.sequences
        ]
    logged = []
    monkeypatch.setattr(
        "loky.process_executor.LOGGER.critical", lambda *words, **_: logged.append(words)
    )
    broken = replace(large, sequences=(SequenceSource("no/where"), *sources[1:]))
    with pytest.raises(SequenceError, match="no/where"):
        make_plan(broken, results, jobs=2)
    assert not logged
