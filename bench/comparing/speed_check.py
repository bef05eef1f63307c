"""Timing of trackers against an older revision, in as many sessions as their spread needs."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np

import datasets
from bench.comparing.baseline import Baseline, BaselineError
from bench.comparing.git_revisions import older_setup
from bench.evaluation.reference import reference
from bench.evaluation.turns import Clip, Setup, TurnError, in_turns
from bench.experiments.contestant import BOXES, run_seed, split_text
from bench.experiments.experiment import SequenceSource
from bench.statistics.speed import (
    Pace,
    PaceLabel,
    Sample,
    judge_pace,
    log_ratio,
    missing_sessions,
    sample_of,
)

CLIPS = 4
"""Number of a tracker's sequences, evenly spread, whose first frames are shown."""

FRAMES = 20


@dataclass(frozen=True)
class SpeedCheck:
    """Change of a tracker's speed, or the reason why it could not be timed."""

    pace: Pace | None = None
    reason: str = ""

    @property
    def state(self) -> PaceLabel:
        """Answer."""
        return self.pace.state if self.pace else "inconclusive"


def check_speeds(
    baseline: Baseline,
    labels: Sequence[str],
    revision: str,
    budget: float,
    report: Callable[[str], None],
) -> dict[str, SpeedCheck]:
    """Time trackers of a baseline against a git revision of their files.

    `labels`: which trackers; they are timed on the first frames of their sequences. `budget`:
    seconds after which no session is added; trackers share them. `report`: called with a sentence
    on the progress.

    Raises `BaselineError` if a tracker has no such revision or no sequence to be timed on.
    """
    checks = {}
    ends = monotonic() + budget
    with tempfile.TemporaryDirectory(prefix="trackmark-") as folder:
        # All first: a missing revision must not waste the time of the others.
        olds = {
            label: older_setup(revision, _setup(baseline, label), Path(folder, str(number)))
            for number, label in enumerate(labels)
        }
        for number, (label, old) in enumerate(olds.items()):
            until = monotonic()
            until += (ends - until) / (len(labels) - number)
            clips = _clips(baseline, label, Path(folder, f"clips-{number}"))
            try:
                sides = [old, _setup(baseline, label)]
                sample = _sample(label, sides, clips, until, len(labels), report)
                checks[label] = SpeedCheck(judge_pace(sample, len(labels)))
            except TurnError as error:
                checks[label] = SpeedCheck(reason=f"the tracker cannot be timed: {error}")
    return checks


def _setup(baseline: Baseline, label: str) -> Setup:
    name, options = split_text(baseline.texts[label])
    return Setup(name, {key: text for key, text in options.items() if key != "init"})


def _sample(
    label: str,
    setups: Sequence[Setup],
    clips: Sequence[Clip],
    until: float,
    tests: int,
    report: Callable[[str], None],
) -> Sample:
    """Run sessions until there are as many as their spread needs, or the time is over."""
    logs: list[float] = []
    began = monotonic()
    while more := missing_sessions(logs, tests):
        affordable = more
        if logs:
            seconds = monotonic() - began
            affordable = max(int((until - began - seconds) * len(logs) / seconds), 0)
            report(
                f"{label}: {len(logs)} sessions in {seconds:.0f} s differ by "
                f"{sample_of(logs).spread:.1%}; {more} more needed"
                + (": a larger --budget gives them." if more > affordable else ".")
            )
        logs += [log_ratio(in_turns(setups, clips)) for _ in range(min(more, affordable))]
        if affordable < more:
            break
    return sample_of(logs)


def _clips(baseline: Baseline, label: str, folder: Path) -> list[Clip]:
    """Write the first frames of a tracker's sequences into a new folder."""
    folder.mkdir()
    _, options = split_text(baseline.texts[label])
    sources = [cell.source for cell in baseline.cells[label].values()]
    indices = np.linspace(0, len(sources) - 1, min(CLIPS, len(sources))).round().astype(int)
    clips = [
        clip
        for index in indices.tolist()
        if (clip := _clip(sources[index], options.get("init", BOXES), label, folder / str(index)))
    ]
    if not clips:
        raise BaselineError(f"{label} cannot be timed: its sequences have one frame.")
    return clips


def _clip(source: SequenceSource, init: str, label: str, stem: Path) -> Clip | None:
    """Write the first frames of a sequence; None if there is only the first one."""
    sequence = datasets.load(source.text, truth=source.truth)
    sequence.check_runnable()
    first = sequence.first_frame
    begin, stop = max(0, first - FRAMES), min(first + 1 + FRAMES, len(sequence))
    if stop < first + 2:
        return None
    images, mask = f"{stem}.npy", sequence.mask(first)
    np.save(images, np.stack([sequence[frame] for frame in range(begin, stop)]))
    if mask is not None:
        np.save(f"{stem}-mask.npy", mask)
    return Clip(
        images=images,
        first=first - begin,
        frames=stop - first - 1,
        box=reference(sequence, init, sequence.name).boxes[first].tolist(),
        mask="" if mask is None else f"{stem}-mask.npy",
        seed=run_seed(label, sequence.name, 0).spawn_key,
    )
