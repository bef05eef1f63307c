"""An experiment of millions of runs is planned, resumed and reported in bounded memory.

Most of its runs are rows of an index whose files are simulated in the listing of the folder; the
others are files. What is measured runs in a process of its own: this file, called with a folder.
"""

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from bench.evaluation.record import Run
from bench.execution.plan import State, make_plan
from bench.experiments.contestant import identify
from bench.experiments.experiment import Experiment, SequenceSource
from bench.store import index
from bench.store.columns import PLACE, coded, numbered, with_place
from bench.store.index import list_runs
from bench.store.results import Results
from bench.store.truth import write_truth
from datasets import load

REPETITIONS = 20
LEFT = 30
MEGABYTE = 1e6


@dataclass(frozen=True)
class Size:
    """How many trackers and sequences there are, and on how many of these runs are files."""

    trackers: int
    sequences: int
    stored: int

    @property
    def runs(self):
        return self.trackers * self.sequences * REPETITIONS


def experiment(folder, size):
    return Experiment(
        name="large",
        trackers=tuple(f"{folder / 'knob.py'}:Knob:knob={i}" for i in range(1, size.trackers + 1)),
        sequences=tuple(SequenceSource(f"plain/target:scene={i}") for i in range(size.sequences)),
        repetitions=REPETITIONS,
    )


def store_files(plan, results, size):
    """Runs on the first sequences, but for the last few: these are left to do."""
    left = LEFT
    for number in range(size.stored):
        sequence = load(plan.sequences[number].source.text)
        write_truth(results.folder, sequence)
        for chosen in plan.trackers.values():
            for repetition in range(REPETITIONS):
                if number == size.stored - 1 and left > 0:
                    left -= 1
                    continue
                n = len(sequence)
                run = Run(
                    identify(chosen, sequence, repetition),
                    boxes=sequence.boxes + repetition,
                    visible=np.ones(n, bool),
                    confidence=np.full(n, np.nan),
                )
                assert results.write(run)


def simulated(plan, size):
    """Index of finished runs on all other sequences, of which there are no files."""
    asked = plan.asked().table
    asked = asked.slice(size.stored * size.trackers * REPETITIONS)
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


def prepare(folder, size):
    results = Results(folder / "results" / "large")
    plan = make_plan(experiment(folder, size), results)
    store_files(plan, results, size)
    table = simulated(plan, size)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench.store.index.list_runs", lambda where: listed(list_runs(where), table))
        patch.setattr("bench.store.index._stored", lambda _: table)
        assert len(index.read_table(results)) == size.runs - LEFT
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


def measure(folder, size):
    """Plan, resume, report; print what it took."""
    import bench
    from bench.execution.run import Execution
    from bench.reporting.tables import tables

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

        execution = Execution(experiment(folder, size), folder / "results", jobs=2)
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


def check(folder, size, evidence):
    (folder / "size.json").write_text(json.dumps(asdict(size)))
    prepare(folder, size)
    done = subprocess.run(
        [sys.executable, __file__, str(folder)], capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert (told["runs"], told["left"], told["made"]) == (size.runs, LEFT, LEFT)
    assert told["done"] == told["rows"] == size.runs
    assert told["tables"] == [size.trackers, size.trackers * size.sequences]
    for name in ("plan", "resume", "load", "report"):
        spent = told[name]
        a_run = (spent["peak"] - told["base"]) / size.runs
        evidence(
            f"{size.runs} runs, {name}: {spent['seconds']:.1f} s, peak {spent['peak'] / 1e6:.0f} MB"
            f" ({a_run:.0f} bytes a run)"
        )
        assert spent["peak"] - told["base"] < 100 * MEGABYTE + 1000 * size.runs, name


@pytest.mark.slow
def test_fifty_thousand_runs_take_less_than_a_kilobyte_each(here, evidence):
    check(here, Size(trackers=25, sequences=100, stored=1), evidence)


@pytest.mark.slow
def test_two_million_runs_take_less_than_a_kilobyte_each(here, evidence):
    check(here, Size(trackers=100, sequences=1000, stored=10), evidence)


if __name__ == "__main__":
    FOLDER = Path(sys.argv[1])
    measure(FOLDER, Size(**json.loads((FOLDER / "size.json").read_text())))
