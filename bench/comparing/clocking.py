"""Clocking trackers beside their older selves or a reference, in as many sessions as it takes."""

import platform
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from math import inf
from pathlib import Path
from time import monotonic

import numpy as np

import datasets
from bench.comparing.baseline import Baseline, BaselineError, Speed
from bench.comparing.revisions import taken_out
from bench.evaluation.reference import reference
from bench.evaluation.turns import Clip, Setup, TurnError, in_turns
from bench.experiments.contestant import BOXES, run_seed, split_text
from bench.experiments.experiment import SequenceSource
from bench.statistics.regression import Sample
from bench.statistics.speed import (
    Pace,
    PaceState,
    judge_pace,
    log_ratio,
    sample_of,
    sessions_for,
    sessions_lacking,
    sessions_needed,
)

__all__ = ["Clock", "Clocked", "processor"]

CLIPS = 4
"""Of so many of a tracker's sequences, evenly among them, the beginning is shown."""

FRAMES = 20


_TOO_FEW = "the baseline's own sessions are too few: give `trackmark baseline` a larger --budget"
_ELSEWHERE = "the baseline's speed is of another processor ({}): give --against REVISION"


@dataclass(frozen=True)
class Clocked:
    """What became of a tracker's speed, or why that can't be told."""

    pace: Pace | None = None
    reason: str = ""

    @property
    def state(self) -> PaceState:
        """The answer."""
        return self.pace.state if self.pace else "cannot tell"


class Clock:
    """Clocks trackers of a baseline, on the beginnings of their sequences.

    `budget`: seconds after which no session is added; trackers share them. `tell`: of the progress.
    """

    def __init__(
        self, baseline: Baseline, labels: Sequence[str], budget: float, tell: Callable[[str], None]
    ) -> None:
        self._baseline, self._labels, self._tell = baseline, labels, tell
        self._ends = monotonic() + budget

    def speeds(self) -> dict[str, Speed]:
        """Speeds beside the reference.

        Raises `BaselineError` for a tracker that can't be clocked.
        """
        found = {}
        for label, now, clips in self._each():
            try:
                sample = self._sample(
                    label, (Setup(), now), clips, lambda s: sessions_for(s, len(self._labels))
                )
            except TurnError as error:
                raise BaselineError(f"{label} can't be clocked: {error}.") from error
            found[label] = Speed(sample, processor())
        return found

    def check(self, revision: str | None) -> dict[str, Clocked]:
        """Clock trackers beside a revision of their files, or against the baseline's speeds.

        Raises `BaselineError` where there is nothing to compare with.
        """
        kept = self._baseline.speeds
        if revision is None and (lacking := [one for one in self._labels if one not in kept]):
            raise BaselineError(
                f"The baseline has no speed of {', '.join(lacking)}: `trackmark baseline --time` "
                "keeps it, or give --against REVISION."
            )
        found = {}
        with tempfile.TemporaryDirectory(prefix="trackmark-") as folder:
            # All first: no work is done for nothing.
            olds = {
                label: taken_out(revision, self._setup(label), Path(folder, str(number)))
                for number, label in enumerate(self._labels)
                if revision is not None
            }
            for label, now, clips in self._each():
                if label in olds or kept[label].processor == processor():
                    found[label] = self._checked(label, olds.get(label, Setup()), now, clips)
                else:
                    found[label] = Clocked(reason=_ELSEWHERE.format(kept[label].processor))
        return found

    def _checked(self, label: str, old: Setup, now: Setup, clips: Sequence[Clip]) -> Clocked:
        before = None if old.name else self._baseline.speeds[label].sample
        tests = len(self._labels)
        needed = partial(sessions_needed, before=before, tests=tests)
        try:
            sample = self._sample(label, (old, now), clips, needed)
        except TurnError as error:
            return Clocked(reason=f"it can't be clocked: {error}")
        pace = judge_pace(sample, before, tests)
        too_few = pace.state == "cannot tell" and needed(sample) == inf
        return Clocked(pace, _TOO_FEW if too_few else "")

    def _each(self) -> Iterator[tuple[str, Setup, Sequence[Clip]]]:
        """Trackers with what they are shown."""
        for number, label in enumerate(self._labels):
            self._until = monotonic()
            self._until += (self._ends - self._until) / (len(self._labels) - number)
            _, options = split_text(self._baseline.texts[label])
            sources = [cell.source for cell in self._baseline.cells[label].values()]
            with tempfile.TemporaryDirectory(prefix="trackmark-") as folder:
                clips = _clips(sources, options.get("init", BOXES), label, Path(folder))
                yield label, self._setup(label), clips

    def _setup(self, label: str) -> Setup:
        name, options = split_text(self._baseline.texts[label])
        return Setup(name, {key: text for key, text in options.items() if key != "init"})

    def _sample(
        self,
        label: str,
        setups: Sequence[Setup],
        clips: Sequence[Clip],
        needed: Callable[[Sample], float],
    ) -> Sample:
        """Sessions until there are as many as their spread needs, or the time is over."""
        logs: list[float] = []
        began = monotonic()
        while more := sessions_lacking(logs, needed):
            affordable = more
            if logs:
                took = monotonic() - began
                affordable = max(int((self._until - began - took) * len(logs) / took), 0)
                self._tell(
                    f"{label}: {len(logs)} sessions in {took:.0f} s differ by "
                    f"{sample_of(logs).spread:.1%}; {more} more needed"
                    + (": a larger --budget gives them." if more > affordable else ".")
                )
            logs += [log_ratio(in_turns(setups, clips)) for _ in range(min(more, affordable))]
            if affordable < more:
                break
        return sample_of(logs)


def _clips(sources: Sequence[SequenceSource], init: str, label: str, folder: Path) -> list[Clip]:
    """Lay beginnings of sequences down."""
    clips = []
    places = np.linspace(0, len(sources) - 1, min(CLIPS, len(sources))).round().astype(int)
    for place in places.tolist():
        sequence = datasets.load(sources[place].text, truth=sources[place].truth)
        sequence.check_runnable()
        first = sequence.first_frame
        begin, stop = max(0, first - FRAMES), min(first + 1 + FRAMES, len(sequence))
        if stop < first + 2:
            continue
        images, mask = folder / f"{place}.npy", sequence.mask(first)
        np.save(images, np.stack([sequence[frame] for frame in range(begin, stop)]))
        if mask is not None:
            np.save(folder / f"{place}-mask.npy", mask)
        clips.append(
            Clip(
                images=str(images),
                first=first - begin,
                frames=stop - first - 1,
                box=reference(sequence, init, sequence.name).boxes[first].tolist(),
                mask="" if mask is None else str(folder / f"{place}-mask.npy"),
                seed=run_seed(label, sequence.name, 0).spawn_key,
            )
        )
    if not clips:
        raise BaselineError(f"{label} can't be clocked: its sequences have one frame.")
    return clips


def processor() -> str:
    """Its name, as far as the system tells: speeds of different ones can't be compared."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
