"""The harness: experiments, the evaluation loop, metrics, results and the command line.

>>> import bench
>>> run = bench.evaluate("static", "samples/face")
>>> 0 < bench.score(run, "samples/face")["mean_overlap"] < 1
True
"""

import signal
import sys

if (
    sys.argv[:1]
    and sys.argv[0].rpartition("/")[2] == "trackmark"
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    # The command: until `main` takes Ctrl-C as a wish, that ends it at once, as out of an import
    # it would be a traceback.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.packages import NameClashError, check_place

if TYPE_CHECKING:
    from bench.evaluation.loop import evaluate
    from bench.evaluation.record import Run
    from bench.evaluation.scoring import score, score_boxes
    from bench.execution.run import run
    from bench.experiments.experiment import Experiment, read_experiment
    from bench.pages.notebook import load_results, player
    from bench.reporting.by_attribute import by_attribute

__all__ = [
    "Experiment",
    "Run",
    "by_attribute",
    "evaluate",
    "load_results",
    "player",
    "read_experiment",
    "run",
    "score",
    "score_boxes",
]

try:
    check_place()
except NameClashError as error:
    if Path(sys.argv[0]).name == "trackmark":  # the command: a line, no traceback
        print(f"trackmark: {error}", file=sys.stderr)  # noqa: T201  # click is not there yet
        sys.exit(2)
    raise

# What a name is found in; imported when it is asked for, so that `trackmark --help` waits
# for no numerics.
_HOMES = {
    "Experiment": "bench.experiments.experiment",
    "Run": "bench.evaluation.record",
    "by_attribute": "bench.reporting.by_attribute",
    "evaluate": "bench.evaluation.loop",
    "load_results": "bench.pages.notebook",
    "player": "bench.pages.notebook",
    "read_experiment": "bench.experiments.experiment",
    "run": "bench.execution.run",
    "score": "bench.evaluation.scoring",
    "score_boxes": "bench.evaluation.scoring",
}


def __getattr__(name: str) -> Any:
    """Import a public name from its home."""
    if name not in _HOMES:
        raise AttributeError(f"module 'bench' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Names of the module, those that are not imported yet too."""
    return sorted({*globals(), *__all__})
