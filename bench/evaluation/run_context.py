"""Context of the calls of a tracker that shares the process with other trackers."""

import os

from trackmark.trackers.base.global_generators import GlobalGenerators
from trackmark.trackers.base.plain_class import end_fork


class RunContext:
    """Global random generators and working directory of a run, while its tracker is called.

    A process that the tracker has forked in a call ends when it leaves the call.

    A tracker that changes the working directory keeps it until its run ends. Meanwhile, relative
    paths of the harness and of other trackers stay valid. `is_alone`: see `GlobalGenerators`.
    """

    def __init__(self, seed: int, *, is_alone: bool) -> None:
        self.generators = GlobalGenerators(seed, is_alone)
        self._process = os.getpid()
        self._home = working_directory()  # the harness does not change it
        self._folder = self._home

    def __enter__(self) -> None:
        if self._folder != self._home:
            os.chdir(self._folder)
        self.generators.__enter__()

    def __exit__(self, *_: object) -> None:
        end_fork(self._process)
        self.generators.__exit__()
        folder = working_directory()
        if folder != self._home:
            os.chdir(self._home)
        self._folder = folder or self._home  # the tracker can have removed its folder

    def drawn_generators(self) -> list[str]:
        """Return the names of the generators from which the tracker has drawn, after its run."""
        self.generators.close()
        return self.generators.drawn


def working_directory() -> str:
    """Return the working directory; empty if it was removed."""
    try:
        return os.getcwd()  # noqa: PTH109  # called for each frame: a Path takes longer
    except FileNotFoundError:
        return ""
