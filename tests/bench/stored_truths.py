"""Ground truths that tests store without running a tracker."""

from trackmark.bench.store.run_store import RunStore
from trackmark.bench.store.truth import pack_truth, stored_truth


def add_truth(folder, fingerprint, truth):
    """Store the ground truth of a sequence with this fingerprint."""
    RunStore(folder).add_all([], [pack_truth(fingerprint, truth)])


def add_truth_of(folder, sequence):
    """Store the ground truth of a sequence."""
    add_truth(folder, sequence.fingerprint, stored_truth(sequence))
