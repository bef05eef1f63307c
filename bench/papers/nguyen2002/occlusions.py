"""Occlusions on scenes: how they are told by outliers, where they end (NG-15 to 17)."""

from time import thread_time
from typing import TypeAlias

import numpy as np
import pandas as pd

from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.events import CLEAR, Declared, hidden_in
from bench.papers.nguyen2002.follower import (
    COLOURS,
    FEATURES,
    Follower,
    Patch,
    View,
    few,
    pale,
    tried,
    true_pose,
)
from bench.papers.scenes import Tables
from datasets import Sequence
from trackers.base.interface import Box, Image
from trackers.templates.appearance import Features
from trackers.templates.occlusion import FIRST_CANDIDATE, visited

__all__ = ["by_speed", "by_speed_on_targets", "slid_over", "watched"]

COVERED = 0.5
"""Visible share of the target below which it is said to be covered."""

IN_VIEW, MATCHED = 0.75, 0.5
"""Visible share and overlap from which on an occlusion's end is found."""

QUICK_BEFORE, QUICK_FRAMES = 10, 60

BEFORE, SLIDING = 10, 20  # frames before something is slid over the target, and from there on
RULES = ("exceeds", "reaches")
SPEEDS = (0.05, 0.06, 0.08)  # template widths a frame
DARK_BLUE = (90, 0, 0)
"""Of no pixel whose levels are between 100 and 202, nor of any ratio or sum of these."""

Row: TypeAlias = dict[str, str | float]


def watched(sequence: Sequence, quick: bool) -> Tables:
    """Outliers and matches before, during and after complete occlusions (NG-15 and NG-17).

    - `ng-15`, a frame in which the template was compared a row: `features`, `frame`, `visibility`,
      `hidden` (1: less than half of the target is seen), `outliers` (share, at the best match),
      `exceeds` (1: more than γ), `stays_below` (1: not). An occlusion that is declared is bridged
      as the tracker does; where the target was lost, it is given again;
    - `ng-17`, an occlusion that was complete and was declared, and `candidates` (`skipped`, `all`
      from 1 to L, `all from 5 to L`) a row: `features`, `beginning` (frame), `offset` (of the end,
      from there), `visibility`, `overlap` (both there), `in_view` (1: .75 or more are seen),
      `found` (1: and the overlap is .5 or more);
    - `ng-17-times`, such an occlusion a row: `features`, `beginning`, `skipped_seconds`,
      `all_seconds` (CPU time for matching the candidates, on the same frames).
    """
    if quick:
        hidden = hidden_in(sequence.visibility)
        begin = max(0, hidden[0].first - QUICK_BEFORE) if hidden else 0
        sequence = sequence[begin : begin + QUICK_FRAMES]
    watches = [_Watch(sequence, features) for features in (COLOURS if quick else FEATURES)]
    tables = {
        "ng-15": [row for watch in watches for row in watch.frames],
        "ng-17": [row for watch in watches for row in watch.ends],
        "ng-17-times": [row for watch in watches for row in watch.times],
    }
    return {name: pd.DataFrame(rows) for name, rows in tables.items()}


def by_speed(sequence: Sequence, quick: bool) -> Tables:
    """What an occluder does to the template until it is declared, by its speed (NG-16).

    `ng-16`: `features`, `speed` (template widths a frame), `declared` (1: before all is covered),
    `coverage` (share of the template that is covered then), `contaminated` (share that is nearer to
    what covers it than to the target). The target is at rest, in one frame of little contrast, dark
    blue is slid over it, unlike any of its pixels, and the template is held at its true place:
    there are no other outliers.
    """
    images = [pale(sequence[0])] * (BEFORE + SLIDING)
    boxes = [sequence.boxes[0]] * len(images)
    patch = Patch(np.full_like(images[0], DARK_BLUE), boxes[0])
    rows = [
        {"features": features, "speed": speed}
        | slid_over(images, boxes, patch, features, "exceeds", speed, matched=False)
        for features in few(quick)
        for speed in SPEEDS
    ]
    return {"ng-16": pd.DataFrame(rows)}


def by_speed_on_targets(sequence: Sequence, quick: bool) -> Tables:
    """The same of targets as they are, with something of the ground slid over them (NG-16).

    `ng-16-targets`: as `ng-16`, and `rule` (`outlier_rule`: `exceeds`, `reaches`).
    """
    frames, ways = BEFORE + SLIDING, {"rule": RULES, "speed": SPEEDS}
    return tried("ng-16-targets", sequence, frames, _covered, few(quick), **ways)


def _covered(part: Sequence, features: Features, rule: str, speed: float) -> dict[str, float]:
    images, boxes = list(part), list(part.boxes)
    patch = Patch(images[0], boxes[0])
    return slid_over(images, boxes, patch, features, rule, speed, matched=True)


def slid_over(
    images: list[Image],
    boxes: list[Box],
    patch: Patch,
    features: Features,
    rule: str,
    speed: float,
    *,
    matched: bool,
) -> dict[str, float]:
    """Slide a patch over the target until an occlusion is declared, or everything is covered.

    The target is wholly seen in the images, and is where the boxes say. After `BEFORE` frames a
    share of it, `speed`, is covered more in each. The template is `matched`, or held at the true
    place; `rule` is the tracker's `outlier_rule`. What is told are the last columns of `ng-16`.
    """
    follower = Follower(images[0], boxes[0], features, outlier_rule=rule)
    for frame, (image, box) in enumerate(zip(images[1:], boxes[1:], strict=True), 1):
        share = min(1.0, max(0, frame - BEFORE + 1) * speed)
        shown, mask = patch.slid_over(image, box, share)
        place = true_pose(boxes[0], box)
        view = follower.look(shown) if matched else follower.compare(shown, place)
        declared = share > 0 and view.seen.share > follower.parameters.gamma
        if declared:
            break
        follower.take(view)
    covered = follower.on_template(mask, box)
    of_target, of_patch = (
        np.abs(follower.appearance.template - follower.truth(one, box)).mean(axis=2)
        for one in (image, shown)
    )
    return {
        "declared": float(declared),
        "coverage": float(covered.mean()),
        "contaminated": float(((of_patch < of_target) & covered).mean()),
    }


_Timed: TypeAlias = tuple[View, float]
"""A view, and the CPU seconds that it took."""


class _Watch:
    """A template kept on a target through a sequence, and given it again where it is lost.

    As in the tracker, more than γ outliers are an occlusion, that of the visited frames in which
    the frozen template fits best is its end, and there the template begins anew. What it begins
    with is the truth where the match is wrong: what comes after is not judged by what was lost.

    The sequence begins with a frame in which the target is wholly seen; `frames`, `ends` and
    `times` are rows of `ng-15`, `ng-17` and `ng-17-times`.
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
        skipped, every = visited(last, "skipped"), list(range(1, last + 1))
        if not skipped:
            return len(self._sequence)
        event = Declared(beginning, None, None)
        complete = any(hidden.causes(event) for hidden in self._hidden)
        looks = {n: self._look(beginning, n) for n in (every if complete else skipped)}
        if complete:
            self._compare(beginning, looks, skipped)
        end = _best(looks, skipped)
        for n in range(1, end + 1):
            view, _ = looks[n] if n in looks else self._look(beginning, n)
            self._say(beginning + n, view)
        return self._go_on(beginning, end, looks[end][0])

    def _compare(self, beginning: int, looks: dict[int, _Timed], skipped: list[int]) -> None:
        """Which frame of those visited, and of all, ends an occlusion, and how long that takes."""
        late = [n for n in looks if n >= FIRST_CANDIDATE]
        for label, offsets in {
            "skipped": skipped,
            "all": [*looks],
            "all from 5 to L": late,
        }.items():
            end = _best(looks, offsets)
            row: Row = {"candidates": label, "beginning": beginning, "offset": end}
            self.ends.append(self._labels | row | self._found(beginning + end, looks[end][0]))
        seconds: Row = {
            "skipped_seconds": sum(looks[n][1] for n in skipped),
            "all_seconds": sum(seconds for _, seconds in looks.values()),
        }
        self.times.append(self._labels | {"beginning": beginning} | seconds)

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

    def _look(self, beginning: int, n: int) -> _Timed:
        image = self._sequence[beginning + n]
        began = thread_time()
        view = self._follower.look(image, n)
        return view, thread_time() - began

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
        visible, shared = float(self._sequence.visibility[frame]), self._overlap(frame, view)
        return {
            "visibility": visible,
            "overlap": shared,
            "in_view": float(visible >= IN_VIEW),
            "found": float(visible >= IN_VIEW and shared >= MATCHED),
        }

    def _overlap(self, frame: int, view: View) -> float:
        box: Box = self._follower.box(view.pose)
        return float(overlap(self._sequence.boxes[frame : frame + 1], box[None])[0])


def _best(looks: dict[int, _Timed], offsets: list[int]) -> int:
    """The frame in which the template fits best."""
    return min(offsets, key=lambda n: looks[n][0].cost)
