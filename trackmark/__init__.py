"""A benchmark for single-object visual trackers.

>>> import trackmark as tm
>>> results = tm.evaluate("static", "samples/face")
>>> 0 < tm.score(results["static", "face"])["mean_overlap"] < 1
True

`trackmark.datasets` has the sequences, `trackmark.trackers` the trackers and `trackmark.metrics`
the definitions of scores.
"""

import importlib
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trackmark import datasets, trackers
    from trackmark.bench import metrics
    from trackmark.bench.api.evaluation import evaluate, run
    from trackmark.bench.api.runs import compare, load_runs
    from trackmark.bench.evaluation.run_record import Run
    from trackmark.bench.evaluation.scoring import score
    from trackmark.bench.evaluation.sequence_cache import load_sequence
    from trackmark.bench.pages.notebook import player
    from trackmark.bench.store.runs import Runs
    from trackmark.datasets import Sequence
    from trackmark.trackers import Estimate, Tracker

__all__ = [
    "Estimate",
    "Run",
    "Runs",
    "Sequence",
    "Tracker",
    "compare",
    "datasets",
    "evaluate",
    "load_runs",
    "load_sequence",
    "metrics",
    "player",
    "run",
    "score",
    "trackers",
]

IMPORT_TIME = time.time()  # wall clock, as files have times of this clock
"""Time of the import [s since 1970]. Modules that were edited later are not those that run."""

# Module of every public name. It is imported on first use: `trackmark --help` needs no NumPy.
_HOMES = {
    "Estimate": "trackmark.trackers",
    "Run": "trackmark.bench.evaluation.run_record",
    "Runs": "trackmark.bench.store.runs",
    "Sequence": "trackmark.datasets",
    "Tracker": "trackmark.trackers",
    "compare": "trackmark.bench.api.runs",
    "evaluate": "trackmark.bench.api.evaluation",
    "load_runs": "trackmark.bench.api.runs",
    "load_sequence": "trackmark.bench.evaluation.sequence_cache",
    "player": "trackmark.bench.pages.notebook",
    "run": "trackmark.bench.api.evaluation",
    "score": "trackmark.bench.evaluation.scoring",
    "datasets": "trackmark.datasets",
    "metrics": "trackmark.bench.metrics",
    "trackers": "trackmark.trackers",
}


def __getattr__(name: str) -> Any:
    """Import a public name on its first use; `__version__` is that of the installed package."""
    if name == "__version__":
        from trackmark.bench.package_version import package_version

        return package_version()
    if name not in _HOMES:
        raise AttributeError(f"module 'trackmark' has no attribute {name!r}")
    module = importlib.import_module(_HOMES[name])
    globals()[name] = value = getattr(module, name, module)
    return value


def __dir__() -> list[str]:
    """Return the public names, including those that are not imported yet."""
    return __all__
