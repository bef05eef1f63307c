"""Trackers on a sequence by a protocol other than one pass: its segments, and what it conducts.

Segments are walked one after another, each by the loop, with trackers begun anew. Of one run over
the whole sequence the protocol's conduct says frame by frame what is done. What comes of it is a
run whose rows are those of its segments, in order.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from math import inf, nan
from statistics import median

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.loop import Clocks, Pass, run_in_lock_step, walk
from trackmark.bench.evaluation.observer import UNOBSERVED, Observer
from trackmark.bench.evaluation.record import Run
from trackmark.bench.evaluation.recorder import COLUMNS, Recorder
from trackmark.bench.evaluation.reference import reference
from trackmark.bench.evaluation.timing import WARM_UP_FRAMES, Remembered
from trackmark.bench.experiments.contestant import Contestant, TrackerMaker, contestant, identify
from trackmark.bench.protocols import ONCE, STORED_ONCE, TIMING, Conduct, Protocol, Segment, Step
from trackmark.bench.protocols import protocol as protocol_of
from trackmark.datasets import Sequence
from trackmark.trackers import Box, Mask
from trackmark.trackers.base.sharing import SharedFrame

_MOST_BYTES = 1 << 28
"""Of images that are kept for the next segment."""


def evaluate(
    tracker: str | TrackerMaker,
    sequence: str | Sequence,
    repetition: int = 0,
    *,
    protocol: str = ONCE,
    keep_arrays: bool = False,
) -> Run:
    """Run one tracker through one sequence, once.

    By default the tracker is initialised with the truth of the first frame in which the target is
    present, and updated on every later frame (one-pass evaluation). With `init=REGION` in its text
    it is initialised with, and scored by, that region of the sequence instead of its boxes.

    Parameters
    ----------
    tracker : str or callable
        Text form such as `camshift:window=adaptive`, or a callable that makes a tracker
        from a `numpy.random.SeedSequence`.
    sequence : str or Sequence
        What to run on; text is passed to `datasets.load`.
    repetition : int
        From 0; another repetition has other random numbers.
    protocol : str
        How it is run: `supervised:skip=10`, say; see docs/protocols.md.
    keep_arrays : bool
        Keep `Estimate.arrays`, masks and maps of every frame; in one pass alone.

    Returns
    -------
    Run
        With status `failed` where the tracker raised or returned a malformed estimate.

    Raises
    ------
    TrackerError, SequenceError, ProtocolError
        For what can't be run: unknown names or parameters, no truth, an unreadable image.
    """
    loaded = datasets.load(sequence) if isinstance(sequence, str) else sequence
    entries = [(contestant(tracker), repetition)]
    if protocol in (ONCE, STORED_ONCE):
        return run_in_lock_step(entries, loaded, keep_arrays=keep_arrays).runs[0]
    return run_by_protocol(entries, loaded, protocol_of(protocol)).runs[0]


def frames_of_segments(stored: str, sequence: Sequence, init: str) -> tuple[NDArray[np.int32], ...]:
    """Numbers of the frames of every segment of a run; empty for one over the whole sequence.

    `stored`: the protocol, as runs are filed under it. `init`: what the run starts from.

    Raises `SequenceError` where the sequence has not that region, or no truth.
    """
    if stored in (STORED_ONCE, TIMING):
        return ()
    segments = _segments(protocol_of(stored), sequence, init) or []
    return tuple(np.array(one.frames(len(sequence)), np.int32) for one in segments)


def run_by_protocol(
    entries: Iterable[tuple[Contestant, int]],
    sequence: Sequence,
    one: Protocol,
    *,
    share: bool = True,
    keep_arrays: bool = False,
    run_seconds: float = inf,
    rows: Collection[NDArray[np.float64]] = (),
    observer: Observer = UNOBSERVED,
) -> Pass:
    """Run several trackers through a sequence together, by a protocol.

    Parameters, result and errors are as of `bench.evaluation.loop.run_in_lock_step`, which is the
    protocol one-pass and alone keeps arrays; `rows` have a row a frame of every segment.
    """
    entries = list(entries)
    if one.text == STORED_ONCE:
        return run_in_lock_step(
            entries,
            sequence,
            share=share,
            keep_arrays=keep_arrays,
            run_seconds=run_seconds,
            rows=rows,
            observer=observer,
        )
    sequence.check_runnable()
    rules = _Rules(one, share, len(entries) == 1, run_seconds)
    kept: Iterable[NDArray[np.float64] | None] = rows or [None] * len(entries)
    runs = [
        _Made(chosen, repetition, sequence, rules, own)
        for (chosen, repetition), own in zip(entries, kept, strict=True)
    ]
    if one.clocked:  # nothing is compiled while the clock runs
        warming = [run.recorder(Segment(), sequence, warming=True) for run in runs]
        stop = min(len(sequence), sequence.first_frame + WARM_UP_FRAMES)
        walk(warming, sequence, stop, observer, to_the_end=False)
    frames, clocks, shown = sequence.frames, Clocks(), 0.0
    try:
        if any(len(run.segments) > 1 for run in runs):
            sequence.frames = Remembered(frames, _MOST_BYTES)
        # Trackers that start from other regions may have other segments.
        for segments in dict.fromkeys(run.segments for run in runs):
            alike = [number for number, run in enumerate(runs) if run.segments == segments]
            share_of_all = len(alike) / len(runs)
            for segment in segments:
                numbers = segment.frames(len(sequence))
                told = _Told(observer, alike, numbers, shown, share_of_all)
                _walk_segment([runs[number] for number in alike], segment, sequence, told, clocks)
                shown += len(numbers) * share_of_all
    finally:
        sequence.frames = frames
    overhead = median(clocks.own) if clocks.own else nan
    return Pass([run.result() for run in runs], overhead, clocks.fetching / max(shown, 1.0))


@dataclass(frozen=True)
class _Rules:
    """What holds for all trackers of a pass."""

    protocol: Protocol
    share: bool
    alone: bool
    run_seconds: float


class _Made:
    """A run, and the parts of it that are made."""

    def __init__(
        self,
        chosen: Contestant,
        repetition: int,
        sequence: Sequence,
        rules: _Rules,
        rows: NDArray[np.float64] | None,
    ) -> None:
        self.rules, self.chosen = rules, chosen
        self.identity = identify(chosen, sequence, repetition, rules.protocol.text)
        asked = _segments(rules.protocol, sequence, chosen.init)
        self.segments = tuple(asked or [Segment()])
        numbers = [segment.frames(len(sequence)) for segment in self.segments]
        self._ends = np.cumsum([len(of) for of in numbers]).tolist()
        self._rows = np.full((self._ends[-1], COLUMNS), nan) if rows is None else rows
        self._frames = tuple(np.array(of, np.int32) for of in numbers if asked)
        self._parts: list[_Part] = []

    @property
    def failure(self) -> str:
        """Why its tracker failed; the segments after that are not begun."""
        return self._parts[-1].failure if self._parts else ""

    @property
    def seconds(self) -> float:
        """What its trackers have taken so far."""
        return self._parts[-1].seconds if self._parts else 0.0

    def recorder(self, segment: Segment, view: Sequence, *, warming: bool = False) -> "_Part":
        """The recorder of the next segment; `warming`: of one that is thrown away."""
        place = len(self._parts)
        end = self._ends[place]
        rows = self._rows[end - len(view) : end]
        rows = rows.copy() if warming else rows
        part = _Part(self, place, segment, view, rows)
        if not warming:
            self._parts.append(part)
        return part

    def result(self) -> Run:
        """The run as it stands."""
        made = [part.result() for part in self._parts]
        details: dict[str, NDArray[np.float64]] = {}
        for run, end in zip(made, self._ends, strict=False):  # a failed one lacks the last ones
            for key, values in run.details.items():
                column = details.setdefault(key, np.full(len(self._rows), nan))
                column[end - len(values) : end] = values
        updates = [second for part in self._parts for second in part.updates]
        told = {"seconds": self.seconds}
        conduct = self._parts[0].conduct
        return replace(
            made[0],
            boxes=self._rows[:, :4].copy(),
            visible=self._rows[:, 4] == 1,
            confidence=self._rows[:, 5].copy(),
            details=details,
            failure=self.failure,
            circumstances=told | ({"update_seconds": median(updates)} if updates else {}),
            states=conduct.states,
            answered=conduct.answered,
            segments=self._frames,
        )


class _Part(Recorder):
    """One tracker on one segment, as the protocol conducts it."""

    def __init__(
        self,
        made: _Made,
        place: int,
        segment: Segment,
        view: Sequence,
        rows: NDArray[np.float64],
    ) -> None:
        rules = made.rules
        super().__init__(
            made.chosen,
            made.identity.repetition,
            view,
            protocol=rules.protocol.text,
            share=rules.share,
            keep_arrays=False,
            alone=rules.alone,
            run_seconds=rules.run_seconds,
            rows=rows,
        )
        self.identity = made.identity  # of the whole sequence
        self.seconds = made.seconds  # the limit is that of all segments
        self._begun = place
        self._moved = any(segment.moved)
        first = view.first_frame
        truth = reference(view, made.chosen.init, view.name)
        self.conduct = rules.protocol.conduct(truth, first, view.image_size) or Conduct()
        self._given = self._given.copy()
        self._given[first] = segment.given(self._given[first])
        self._said = rows.copy()  # by frame, wherever it stands

    @property
    def updates(self) -> list[float]:
        """Seconds of CPU that each update took."""
        return self._updates

    def start(self, shown: SharedFrame, frame: int, mask: Mask | None) -> None:
        """See `Recorder.start`; a mask would say what a box that was moved is to hide."""
        super().start(shown, frame, None if self._moved else mask)
        self._said[frame] = self._rows[frame]

    def follow(self, shown: SharedFrame, frame: int) -> float:
        """Do what the protocol says at a frame; give the seconds that the tracker took."""
        step, before = self.conduct.step(frame), self.seconds
        if step is Step.BEGIN:
            self._made = None
            self._begun += 1
            self.start(shown, frame, self._sequence.mask(frame))
            return self.seconds - before
        if step is Step.ASK:
            took = super().follow(shown, frame)
            self._said[frame] = self._rows[frame]
            if not self.failure and (why := self.conduct.told(frame, self._rows[frame], took)):
                self.fail(frame, why)
        if self.conduct.answered is not None and not self.failure:
            self._rows[frame] = self._said[self.conduct.answered[frame]]
        return self.seconds - before

    def _take_revision(self, frame: int, revised: Mapping[int, Box]) -> None:
        """What a tracker says later is kept in one pass alone."""


class _Told(Observer):
    """Passes on what a walk over a segment tells, in the numbers of the whole run.

    `entries`: numbers of the trackers, by their places in the walk. `frames`: of the segment.
    `before`: frames shown before it. `share`: what part of all trackers these are.
    """

    def __init__(
        self, observer: Observer, entries: list[int], frames: range, before: float, share: float
    ) -> None:
        self._observer, self._frames = observer, frames
        self._before, self._share = before, share
        self.entries = entries

    def reading(self, frame: int) -> None:
        """See `Observer`."""
        self._observer.reading(self._frames[frame])

    def calling(self, entry: int, frame: int) -> None:
        """See `Observer`."""
        self._observer.calling(self.entries[entry], self._frames[frame])

    def called(self, entry: int) -> None:
        """See `Observer`."""
        self._observer.called(self.entries[entry])

    def shown(self, frames: int) -> None:
        """See `Observer`."""
        self._observer.shown(int(self._before + frames * self._share))


def _walk_segment(
    runs: list[_Made], segment: Segment, sequence: Sequence, told: _Told, clocks: Clocks
) -> None:
    """Walk the trackers that have not failed yet over a segment."""
    going = [number for number, run in enumerate(runs) if not run.failure]
    if not going:
        return
    told.entries = [told.entries[number] for number in going]
    view = sequence if segment.start == 0 and segment.step == 1 else sequence[segment.slice]
    recorders = [runs[number].recorder(segment, view) for number in going]
    walked = walk(recorders, view, len(view), told)
    clocks.fetching += walked.fetching
    clocks.own += walked.own


def _segments(one: Protocol, sequence: Sequence, init: str) -> list[Segment] | None:
    given = reference(sequence, init, sequence.name).boxes
    present = sequence.present & np.isfinite(given).all(axis=1)
    return one.segments(present, sequence.values)
