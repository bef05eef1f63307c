"""Ground truths that tests store without running a tracker."""

from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import stored_truth


def add_truth_of(folder, sequence):
    """Store the ground truth of a sequence."""
    RunStore(folder).add_all([], [stored_truth(sequence)])
