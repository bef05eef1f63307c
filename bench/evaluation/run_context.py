"""Random generators and working directory of the process, which the trackers of a pass share.

`SharedState` belongs to a pass and decides whether each tracker needs its own state. `RunContext`
is the state of one tracker.
"""

import os
import sys
from collections.abc import Callable
from typing import TypeVar

from trackmark.bench.operating_system import working_directory
from trackmark.trackers.base.global_generators import GlobalGenerators

R = TypeVar("R")

FIRST_CHECK = 4
"""Number of frames after which a pass checks for the first time whether trackers need contexts."""


class StateChangedError(Exception):
    """A tracker has changed the shared state of the process during its pass."""


class SharedState:
    """State of the process that the trackers of a pass share while none of them changes it.

    Setting the state of each tracker at each call takes longer than the rest of the harness. Most
    trackers neither draw from global generators nor change the working directory. A pass therefore
    uses contexts only for its first `FIRST_CHECK` frames. If no tracker has changed its state until
    then, the pass goes on without them, and checks after 8, 16, 32, … frames and at its end that
    the state is still the same. Otherwise, the pass is worthless, because one tracker can have
    changed the numbers of another. `in_shared_state` then repeats it with contexts for all calls.
    """

    def __init__(self, *, may_share: bool) -> None:
        self.needs_contexts = True
        self._next_check = FIRST_CHECK if may_share else 0
        self._n_frames = 0
        self._contexts: list[RunContext] = []
        self._untouched: GlobalGenerators | None = None  # while the pass uses no contexts
        self._has_torch = False
        self._home = working_directory()

    def context(self, seed: int) -> "RunContext":
        """Return the context of a new tracker."""
        context = RunContext(seed)
        self._contexts.append(context)
        return context

    def on_frame_done(self) -> None:
        """Check the state after some of the frames; raise `StateChangedError` if it has changed."""
        self._n_frames += 1
        if self._n_frames != self._next_check:
            return
        self._next_check *= 2
        if self.needs_contexts:
            if any(context.is_needed() for context in self._contexts):
                self._next_check = 0
                return
            self.needs_contexts = False
            self._has_torch = "torch" in sys.modules
            self._untouched = GlobalGenerators(0)
            self._untouched.__enter__()
        elif self.has_changed():
            raise StateChangedError

    def has_changed(self) -> bool:
        """Return whether a tracker has changed the state since the pass uses no contexts."""
        if self._untouched is None:
            return False
        self._untouched.__exit__()
        self._untouched.__enter__()
        folder = working_directory()
        if folder != self._home:
            os.chdir(self._home)
        # The generator of a library that was imported meanwhile is not seeded.
        is_new = self._has_torch != ("torch" in sys.modules)
        return folder != self._home or bool(self._untouched.drawn) or is_new


def in_shared_state(call: Callable[[SharedState], R], *, may_share: bool) -> R:
    """Return the result of a pass; repeat it with contexts if a tracker needs them after all.

    `may_share` is whether the trackers may share the state of the process at first.
    """
    state = SharedState(may_share=may_share)
    try:
        result = call(state)
        if not state.has_changed():
            return result
    except StateChangedError:
        pass
    except Exception:  # can be a consequence, for example of a relative path
        if not state.has_changed():
            raise
    return call(SharedState(may_share=False))


class RunContext:
    """Global random generators and working directory of a run, while its tracker is called.

    A tracker that changes the working directory keeps it until its run ends. Meanwhile, relative
    paths of the harness and of other trackers stay valid.
    """

    def __init__(self, seed: int) -> None:
        self.generators = GlobalGenerators(seed)
        self._home = working_directory()  # the harness does not change it
        self._folder = self._home

    def __enter__(self) -> None:
        if self._folder != self._home:
            os.chdir(self._folder)
        self.generators.__enter__()

    def __exit__(self, *_: object) -> None:
        self.generators.__exit__()
        folder = working_directory()
        if folder != self._home:
            os.chdir(self._home)
        self._folder = folder or self._home  # the tracker can have removed its folder

    def is_needed(self) -> bool:
        """Return whether the tracker has drawn from a generator or changed the folder so far."""
        return bool(self.generators.drawn) or self._folder != self._home
