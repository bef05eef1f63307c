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

from typing import TYPE_CHECKING, Any

from trackmark import bench

if TYPE_CHECKING:
    from trackmark.bench import *  # noqa: F403  # its public names

__all__ = bench.__all__


def __getattr__(name: str) -> Any:
    """Import a public name of `trackmark.bench` on its first use."""
    if name not in bench.__all__:
        raise AttributeError(f"module 'trackmark' has no attribute {name!r}")
    return getattr(bench, name)


def __dir__() -> list[str]:
    """Return the names of the module, including those that are not imported yet."""
    return sorted({*globals(), *bench.__all__})
