"""Memory of planning, resuming and reporting a large experiment.

Most of its runs are rows of an index whose files are simulated in the listing of the folder; the
others are files. What is measured runs in a process of its own: this file, called with a folder.
"""

import json
import subprocess
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.plan import State, make_plan
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_spec import identify
from trackmark.bench.store import index
from trackmark.bench.store.columns import PLACE, coded, numbered, with_place
from trackmark.bench.store.index import list_runs
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import write_truth
from trackmark.datasets import load

TRACKERS = 25
SEQUENCES = 100
REPETITIONS = 20
RUNS = TRACKERS * SEQUENCES * REPETITIONS
LEFT = 30
MEGABYTE = 1e6


def experiment(folder):
    return Experiment(
        name="large",
        trackers=tuple(f"{folder / 'knob.py'}:Knob:knob={i}" for i in range(1, TRACKERS + 1)),
        sequences=tuple(SequenceSource(f"plain/target:scene={i}") for i in range(SEQUENCES)),
        repetitions=REPETITIONS,
    )


def store_files(plan, results):
    """Store the runs on the first sequence, except the first few, which are left to do."""
    sequence = load(plan.sequences[0].source.text)
    write_truth(results.folder, sequence)
    for chosen, repetition in list(product(plan.trackers.values(), range(REPETITIONS)))[LEFT:]:
        n = len(sequence)
        run = Run(
            identify(chosen, sequence, repetition),
            boxes=sequence.boxes + repetition,
            visible=np.ones(n, bool),
            confidence=np.full(n, np.nan),
        )
        assert results.write(run)


def simulated(plan):
    """Return an index of finished runs on all other sequences, which have no files."""
    asked = plan.asked().table.slice(TRACKERS * REPETITIONS)
    n = len(asked)
    rng = np.random.default_rng(0)
    texts = {name: coded([""], np.zeros(n)) for name in ("preset", "parameters", "failure")}
    same = ("tracker_name", "tracker_version", "source", "truth")
    texts |= {name: coded(["a"], np.zeros(n)) for name in same}
    texts |= {"status": coded(["finished"], np.zeros(n))}
    texts |= {"fingerprint": coded([s.fingerprint for s in plan.sequences], np.zeros(n))}
    numbers = {name: pa.array(np.ones(n, np.int64)) for name in ("frames", "size", "mtime")}
    numbers |= {
        name: rng.random(n) for name in ("seconds", "frame_seconds", "update_seconds", *SCORES)
    }
    table = pa.table({**{name: asked[name] for name in asked.column_names}, **texts, **numbers})
    return table.set_column(
        table.schema.get_field_index("frames"), "frames", table["frames"].cast(pa.int32())
    )


def listed(files, table):
    """The listing of a folder with the simulated files among it."""
    more = with_place(table).select(files.column_names)
    both = pa.concat_tables([files, more]).unify_dictionaries().combine_chunks()
    return both.take(np.argsort(numbered([both], PLACE)[0]))


SCORES = [
    "mean_overlap",
    "success_frames",
    "success_share",
    "frames_inside",
    "inside_share",
    "evaluated_frames",
    "first_loss",
    "centre_error",
    "centre_error_median",
    "centre_error_p90",
]


def prepare(folder):
    results = Results(folder / "results" / "large")
    plan = make_plan(experiment(folder), results)
    store_files(plan, results)
    table = simulated(plan)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "trackmark.bench.store.index.list_runs", lambda where: listed(list_runs(where), table)
        )
        patch.setattr("trackmark.bench.store.index._stored", lambda _: table)
        assert len(index.read_table(results)) == RUNS - LEFT
    with pa.OSFile(str(folder / "simulated.arrow"), "wb") as file:
        kept = table.select(["tracker", "sequence", "protocol", "repetition", "size", "mtime"])
        with pa.ipc.new_file(file, kept.schema) as writer:
            writer.write_table(kept)


def peak():
    """Most memory that this process has had, in bytes; `getrusage` would count its parent's."""
    (line,) = (
        line for line in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line
    )
    return int(line.split()[1]) * 1024


def measure(folder):
    """Plan, resume, report; print what it took."""
    from trackmark import bench
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.reporting.tables import tables

    with pa.memory_map(str(folder / "simulated.arrow")) as file:
        table = pa.ipc.open_file(file).read_all()
        small = Experiment("small", ("static",), (SequenceSource("plain/target"),))
        tables(bench.run(small, folder / "results"))  # what is imported is no matter of scale
        told = {"base": peak()}
        index.list_runs = lambda where: listed(list_runs(where), table)
        began = time.monotonic()

        def step(name):
            nonlocal began
            told[name] = {"seconds": time.monotonic() - began, "peak": peak()}
            began = time.monotonic()

        execution = Execution(experiment(folder), folder / "results", jobs=2)
        told |= {"runs": len(execution.plan), "left": execution.units.runs}
        step("plan")
        told["made"] = sum(1 for _ in execution.rows())
        step("resume")
        told["done"] = execution.plan.seen_in(index.read_table(Results(execution.folder))).count(
            State.DONE
        )
        frame = bench.load_results(execution.folder)
        told["rows"] = len(frame)
        del frame
        step("load")
        summary, sequences = tables(execution.folder)
        told["tables"] = [len(summary.rows), len(sequences.rows)]
        step("report")
    sys.stdout.write(json.dumps(told))


@pytest.mark.slow
def test_fifty_thousand_runs_need_less_than_a_kilobyte_each(here, evidence):
    prepare(here)
    done = subprocess.run(
        [sys.executable, __file__, str(here)], capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["runs"], told["left"], told["made"]) == (RUNS, LEFT, LEFT)
    assert told["done"] == told["rows"] == RUNS
    assert told["tables"] == [TRACKERS, TRACKERS * SEQUENCES]
    for name in ("plan", "resume", "load", "report"):
        seconds, extra = told[name]["seconds"], told[name]["peak"] - told["base"]
        evidence(
            f"{RUNS} runs, {name}: {seconds:.1f} s, peak {told[name]['peak'] / 1e6:.0f} MB"
            f" ({extra / RUNS:.0f} bytes a run)"
        )
        assert extra < 100 * MEGABYTE + 1000 * RUNS, name


if __name__ == "__main__":
    measure(Path(sys.argv[1]))
