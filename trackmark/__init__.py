"""A benchmark for single-object visual trackers.

>>> import trackmark
>>> run = trackmark.evaluate("static", "samples/face")
>>> 0 < trackmark.score(run, "samples/face")["mean_overlap"] < 1
True

`trackmark.datasets` has the sequences, `trackmark.trackers` the trackers.
"""

import signal
import sys

if (
    sys.argv[:1]
    and sys.argv[0].rpartition("/")[2] == "trackmark"
    and signal.getsignal(signal.SIGINT) is signal.default_int_handler
):
    # The command: Ctrl-C ends the process until `main` handles it. During an import, Python would
    # print a traceback.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from trackmark.bench import (
        Experiment,
        Run,
        by_attribute,
        evaluate,
        load_results,
        player,
        read_experiment,
        run,
        score,
        score_boxes,
    )

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


def __getattr__(name: str) -> Any:
    """Import a public name of `trackmark.bench` on its first use."""
    if name not in __all__:
        raise AttributeError(f"module 'trackmark' has no attribute {name!r}")
    return getattr(importlib.import_module("trackmark.bench"), name)


def __dir__() -> list[str]:
    """Return the names of the module, including those that are not imported yet."""
    return sorted({*globals(), *__all__})
