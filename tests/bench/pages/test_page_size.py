"""Size of the page of many runs."""

import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import open_frame, write_experiment_page
from tests.bench.stored_truths import add_truth_of
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.experiments.tracker_spec import run_identity
from trackmark.bench.store.run_store import RunStore
from trackmark.datasets import load

TRACKERS = ("camshift", "mean-shift", "particle-filter", "opencv-mil", "multipart", "wang2010")
MEGABYTE = 1_000_000


def stored(folder, sequences, repetitions):
    """Store results of trackers that walk at random around the ground truth."""
    sources = tuple(map(SequenceSpec, sequences))
    experiment = Experiment("many", TRACKERS, sources, repetitions=repetitions)
    results = RunStore(folder / "many")
    plan = make_plan(experiment, results)
    results.add_requests(plan.requested)
    rng = np.random.default_rng(0)
    for number in range(len(sequences)):
        sequence = load(plan.sequences[number].source.spec)
        add_truth_of(results.folder, sequence)
        n = len(sequence)
        for tracker in plan.trackers.values():
            for repetition in range(repetitions):
                walk = rng.normal(0, 1.5, (n, 2)).cumsum(axis=0)
                boxes = sequence.boxes + np.hstack([walk, rng.normal(0, 0.5, (n, 2)).round(2)])
                boxes[0] = sequence.boxes[0]
                boxes[:, 2:] = boxes[:, 2:].clip(2)
                fields = {"visible": np.ones(n, bool), "confidence": np.full(n, np.nan)}
                fields["metadata"] = {"source": sequences[number]}
                assert results.add(
                    Run(run_identity(tracker, sequence, repetition), boxes, **fields)
                )
    return results.folder


@browser.needs_browser
@pytest.mark.weekly
@pytest.mark.parametrize(("count", "length", "repetitions"), [(8, 400, 20), (100, 120, 2)])
def test_page_of_many_runs_opens(tmp_path, chromium, evidence, count, length, repetitions):
    names = [f"plain/target:length={length}:width=640:height=480:scene={n}" for n in range(count)]
    folder = stored(tmp_path, names, repetitions)
    page = write_experiment_page(folder, tmp_path)
    size = page.stat().st_size
    evidence(f"page of {count} sequences, {length} frames each: {size / MEGABYTE:.1f} MB")
    assert size < 25 * MEGABYTE
    chromium.console.clear()
    chromium.open(page.as_uri())
    open_frame(chromium, sequence=load(names[-1]).name, frame=50)
    assert chromium.console == []
