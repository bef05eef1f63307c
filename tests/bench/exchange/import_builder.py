"""Import of one tracker's results on one sequence."""

import numpy as np

from trackmark.bench.exchange.importing import ImportedTracker, ResultSequence, import_results
from trackmark.bench.store.run_store import RunStore


def result_sequence(name, boxes, **options):
    """Return a sequence that has only boxes as ground truth."""
    unknown = {"regions": {}, "visibility": np.full(len(boxes), np.nan), "attributes": {}}
    paths = {"fingerprint": f"fingerprint {name}", "source": f"/data/{name}"}
    return ResultSequence(name, boxes=boxes, fps=None, **{**unknown, **paths, **options})


def import_runs(kind, theirs, sequence, target, on_message=lambda message: None, first_pixel=1):
    """Import a folder of results and return the stored runs.

    `sequence`: a `ResultSequence`, or its name and ground truth.
    """
    if not isinstance(sequence, ResultSequence):
        name, truth = sequence
        sequence = result_sequence(name, truth, first_pixel=first_pixel)
    import_results([ImportedTracker("theirs", kind, theirs)], [sequence], target, on_message)
    results = RunStore(target)
    return [results.read(key) for key in results.list_keys()]
