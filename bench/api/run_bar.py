"""Progress bar of runs in this process."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from tqdm import tqdm

from trackmark.bench.evaluation.recorder import Observer
from trackmark.datasets import Sequence


class RunBar(Observer):
    """Bar on standard error, which appears after a second and disappears at the end.

    `is_shown`: by default in a terminal and in a notebook.
    """

    def __init__(self, *, is_shown: bool | None) -> None:
        in_notebook = True if "ipykernel" in sys.modules else None
        is_shown = in_notebook if is_shown is None else is_shown
        self._bar = tqdm(
            total=0,
            bar_format="[{bar:20}] {desc}",
            ascii=".#",
            delay=1.0,
            leave=False,
            miniters=0,  # fixed: the time alone decides when the bar is drawn
            disable=None if is_shown is None else not is_shown,  # None: only in a terminal
        )
        self._done = self._n_runs = 0  # runs of earlier passes, and of the present one
        self._sequence: Sequence | None = None

    def expect(self, n_runs: int) -> None:
        """Add runs to the expected runs."""
        self._bar.total = (self._bar.total or 0) + n_runs

    @contextmanager
    def running(self, n_runs: int, sequence: Sequence) -> Iterator[None]:
        """Within the context, `n_runs` runs on a sequence are in progress."""
        self._n_runs, self._sequence = n_runs, sequence
        yield
        self._done += n_runs

    def on_frame(self, frame: int, n_done: int) -> None:
        """Show the frame. A protocol can read a frame several times."""
        if self._bar.disable or self._sequence is None:
            return
        share = frame / len(self._sequence)
        counts = f"{self._done}/{self._bar.total} runs, {self._sequence.name}, frame {frame}"
        self._bar.set_description_str(counts, refresh=False)
        self._bar.update(self._done + share * self._n_runs - self._bar.n)

    def close(self) -> None:
        """Remove the bar."""
        self._bar.close()
