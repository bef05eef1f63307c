"""The harness: experiments, the evaluation loop, metrics, results and the command line.

These functions are below those of `import trackmark`.

>>> from trackmark import bench
>>> run = bench.evaluate_run("static", "samples/face")
>>> run.status
'finished'
"""

if __name__ != "trackmark.bench":
    raise ImportError("Import `trackmark.bench` instead of `bench`.")

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trackmark.bench.evaluation.loop import evaluate_run
    from trackmark.bench.execution.executor import run_experiment
    from trackmark.bench.experiments.experiment import Experiment, read_experiment
    from trackmark.bench.store.data_frames import load_runs

__all__ = [
    "Experiment",
    "evaluate_run",
    "load_runs",
    "read_experiment",
    "run_experiment",
]

# Module of every public name. It is imported on first use: `trackmark --help` needs no NumPy.
_HOMES = {
    "Experiment": "trackmark.bench.experiments.experiment",
    "evaluate_run": "trackmark.bench.evaluation.loop",
    "load_runs": "trackmark.bench.store.data_frames",
    "read_experiment": "trackmark.bench.experiments.experiment",
    "run_experiment": "trackmark.bench.execution.executor",
}


def __getattr__(name: str) -> Any:
    """Import a public name on its first use."""
    if name not in _HOMES:
        raise AttributeError(f"module 'trackmark.bench' has no attribute {name!r}")
    value = globals()[name] = getattr(importlib.import_module(_HOMES[name]), name)
    return value


def __dir__() -> list[str]:
    """Return the names of the module, including those that are not imported yet."""
    return sorted({*globals(), *__all__})
