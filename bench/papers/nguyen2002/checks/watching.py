"""Outliers and matches before, during and after complete occlusions (NG-15 and NG-17)."""

from time import thread_time
from typing import NamedTuple, TypeAlias

import pandas as pd

from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.checks.follower import FEATURES, Follower, View
from bench.papers.nguyen2002.events import CLEAR, Declared, hidden_in
from datasets import Sequence
from trackers.base.interface import Box
from trackers.templates.features import Features
from trackers.templates.occlusion import visited

__all__ = ["Watch", "measure"]

COVERED = 0.5
"""Visible share of the target below which it is said to be covered."""

IN_VIEW, MATCHED = 0.75, 0.5
"""Visible share and overlap from which on an occlusion's end is found."""

QUICK_FEATURES: tuple[Features, ...] = ("rgb", "invariants")
QUICK_BEFORE, QUICK_FRAMES = 10, 60


Row: TypeAlias = dict[str, str | float]


class Timed(NamedTuple):
    """A view, and the CPU seconds that it took."""

    view: View
    seconds: float


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `ng-15`, `ng-17` and `ng-17-times`; see `bench.papers.nguyen2002.checks`."""
    if quick:
        hidden = hidden_in(sequence.visibility)
        begin = max(0, hidden[0].first - QUICK_BEFORE) if hidden else 0
        sequence = sequence[begin : begin + QUICK_FRAMES]
    watches = [Watch(sequence, features) for features in (QUICK_FEATURES if quick else FEATURES)]
    tables = {
        "ng-15": [row for watch in watches for row in watch.frames],
        "ng-17": [row for watch in watches for row in watch.ends],
        "ng-17-times": [row for watch in watches for row in watch.times],
    }
    return {name: pd.DataFrame(rows) for name, rows in tables.items()}


class Watch:
    """A template kept on a target through a sequence, and given it again where it is lost.

    As in the tracker, more than γ outliers are an occlusion, that of the visited frames in which
    the frozen template fits best is its end, and there the template begins anew. What it begins
    with is the truth where the match is wrong: what comes after is not judged by what was lost.

    Parameters
    ----------
    sequence : Sequence
        From a frame on in which the target is wholly seen.
    features : str

    Attributes
    ----------
    frames, ends, times : list of dict
        Rows of `ng-15`, `ng-17` and `ng-17-times`.
    """

    def __init__(self, sequence: Sequence, features: Features) -> None:
        self._sequence = sequence
        self._follower = Follower(sequence[0], sequence.boxes[0], features)
        self._labels: Row = {"features": features}
        self._hidden = hidden_in(sequence.visibility)
        self.frames: list[Row] = []
        self.ends: list[Row] = []
        self.times: list[Row] = []
        frame = 1
        while frame < len(sequence):
            frame = self._after(frame) + 1

    def _after(self, frame: int) -> int:
        """See a frame; if an occlusion begins there, go to the one where the target is known."""
        view = self._follower.look(self._sequence[frame])
        self._say(frame, view)
        if view.seen.share > self._follower.parameters.gamma:
            return self._bridge(frame)
        self._follower.take(view)
        if self._sequence.visibility[frame] >= CLEAR and self._overlap(frame, view) < MATCHED:
            self._give(frame)
        return frame

    def _bridge(self, beginning: int) -> int:
        """Look for an occlusion's end, and begin anew there."""
        longest = self._follower.parameters.longest_occlusion
        last = min(longest, len(self._sequence) - 1 - beginning)
        skipped, every = (visited(last, candidates) for candidates in ("skipped", "all"))
        if not skipped:
            return len(self._sequence)
        event = Declared(beginning, None, None)
        complete = any(hidden.causes(event) for hidden in self._hidden)
        looks = {n: self._look(beginning, n) for n in (every if complete else skipped)}

        def best(offsets: list[int]) -> int:
            return min(offsets, key=lambda n: looks[n].view.cost)

        if complete:
            candidates = {"skipped": skipped, "all from 5 to L": every}
            for label, offsets in candidates.items():
                end = best(offsets)
                row: Row = {"candidates": label, "beginning": beginning, "offset": end}
                self.ends.append(self._labels | row | self._found(beginning + end, looks[end].view))
            seconds: Row = {
                name: sum(looks[n].seconds for n in offsets)
                for name, offsets in {"skipped_seconds": skipped, "all_seconds": every}.items()
            }
            self.times.append(self._labels | {"beginning": beginning} | seconds)
        end = best(skipped)
        for n in range(1, end + 1):
            look = looks[n] if n in looks else self._look(beginning, n)
            self._say(beginning + n, look.view)
        return self._go_on(beginning, end, looks[end].view)

    def _go_on(self, beginning: int, end: int, view: View) -> int:
        frame = beginning + end
        if self._found(frame, view)["found"]:
            self._follower.restart_after(self._sequence[frame], view.pose, end + 1)
            return frame
        while frame < len(self._sequence) and self._sequence.visibility[frame] < CLEAR:
            frame += 1
        if frame < len(self._sequence):
            self._give(frame)
        return frame

    def _look(self, beginning: int, n: int) -> Timed:
        image = self._sequence[beginning + n]
        began = thread_time()
        view = self._follower.look(image, n)
        return Timed(view, thread_time() - began)

    def _give(self, frame: int) -> None:
        self._follower.restart(self._sequence[frame], self._sequence.boxes[frame])

    def _say(self, frame: int, view: View) -> None:
        visible, share = float(self._sequence.visibility[frame]), view.seen.share
        exceeds = share > self._follower.parameters.gamma
        row: Row = {
            "frame": frame,
            "visibility": visible,
            "hidden": float(visible < COVERED),
            "outliers": share,
            "exceeds": float(exceeds),
            "stays_below": float(not exceeds),
        }
        self.frames.append(self._labels | row)

    def _found(self, frame: int, view: View) -> Row:
        visible = float(self._sequence.visibility[frame])
        shared = self._overlap(frame, view)
        return {
            "visibility": visible,
            "overlap": shared,
            "in_view": float(visible >= IN_VIEW),
            "found": float(visible >= IN_VIEW and shared >= MATCHED),
        }

    def _overlap(self, frame: int, view: View) -> float:
        box: Box = self._follower.box(view.pose)
        return float(overlap(self._sequence.boxes[frame : frame + 1], box[None])[0])
