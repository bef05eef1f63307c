"""Context of the calls of a tracker that shares the process with other trackers."""

import os

from trackmark.trackers.base.global_generators import GlobalGenerators


class RunContext:
    """Global random generators and working directory of a run, while its tracker is called.

    A tracker that changes the working directory keeps it until its run ends. Meanwhile, relative
    paths of the harness and of other trackers stay valid.
    """

    def __init__(self, seed: int) -> None:
        self.generators = GlobalGenerators(seed)
        self._folder = ""  # empty: that of the harness

    def __enter__(self) -> None:
        self._home = _working_directory()
        if self._folder:
            os.chdir(self._folder)
        self.generators.__enter__()

    def __exit__(self, *_: object) -> None:
        self.generators.__exit__()
        folder = _working_directory()
        self._folder = "" if folder == self._home else folder
        if folder != self._home:
            os.chdir(self._home)


def _working_directory() -> str:
    """Return the working directory; empty if it was removed."""
    try:
        return os.getcwd()  # noqa: PTH109  # called for each frame: a Path takes longer
    except FileNotFoundError:
        return ""
