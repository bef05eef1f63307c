"""Import of one tracker's results on one sequence."""

from trackmark.bench.exchange.importing import ImportedTracker, ResultSequence, import_results
from trackmark.bench.store.run_store import RunStore


def import_runs(kind, theirs, sequence, target, on_message=lambda message: None, first_pixel=1):
    """Import a folder of results and return the stored runs.

    `sequence`: a `ResultSequence`, or its name and ground truth.
    """
    if not isinstance(sequence, ResultSequence):
        name, truth = sequence
        sequence = ResultSequence(
            name, f"fingerprint {name}", truth, f"/data/{name}", first_pixel=first_pixel
        )
    import_results([ImportedTracker("theirs", kind, theirs)], [sequence], target, on_message)
    results = RunStore(target)
    return [results.read(key) for key in results.list_keys()]
