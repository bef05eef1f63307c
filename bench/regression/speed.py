"""Speed of trackers compared with a git revision of their files."""

import io
import subprocess
import tarfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from math import ceil
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np
import pandas as pd

from trackmark import datasets, trackers
from trackmark.bench.evaluation.ground_truth import select_ground_truth
from trackmark.bench.evaluation.interleaved_timing import TurnError, time_interleaved
from trackmark.bench.evaluation.timed_clips import Clip, Setup
from trackmark.bench.experiments.experiment import SequenceSpec
from trackmark.bench.experiments.tracker_spec import BOXES, split_text
from trackmark.bench.external import is_external
from trackmark.bench.operating_system import temporary_folder
from trackmark.bench.regression.baseline import Baseline, BaselineError
from trackmark.bench.statistics.speed import (
    MIN_SESSIONS,
    RatioSample,
    SpeedChange,
    decide_speed,
    log_ratio,
    missing_sessions,
    ratio_sample,
)
from trackmark.reports.tables import MISSING, Cell, Table
from trackmark.trackers.base.catalogue import in_file, is_outside, run_seed

CLIPS = 4
"""Number of evenly spread sequences of a tracker on which it is timed."""

FRAMES = 20


_PACKAGE = Path(str(trackers.__file__)).resolve().parent
_ORDER = ("slower", "inconclusive", "faster", "not 5 % slower")


def check_speeds(
    baseline: Baseline,
    labels: Sequence[str],
    revision: str,
    budget: float,
    report: Callable[[str], None],
) -> dict[str, SpeedChange]:
    """Time trackers of a baseline against a git revision of their files; slower ones come first.

    The trackers `labels` run on the first frames of their sequences. After `budget` seconds in
    total, no session is added. `report` gets sentences on the progress.

    Raises `BaselineError` if a tracker is not in the revision or has no sequence for timing, or if
    the budget is too small for the least number of sessions.
    """
    speed_changes = {}
    ends = monotonic() + budget
    with temporary_folder() as folder:
        # Extract all trackers first: a missing revision is then reported before any timing.
        specs_of_revision = {
            label: _spec_of_revision(revision, _setup(baseline, label), Path(folder, str(index)))
            for index, label in enumerate(labels)
        }
        for index, (label, old) in enumerate(specs_of_revision.items()):
            deadline = monotonic()
            deadline += (ends - deadline) / (len(labels) - index)
            clips = _clips(baseline, label, Path(folder, f"clips-{index}"))
            try:
                setups = [old, _setup(baseline, label)]
                sample = _sample(label, setups, clips, deadline, len(labels), report)
            except TurnError as error:
                reason = f"the tracker cannot be timed: {error}"
                speed_changes[label] = SpeedChange("inconclusive", reason=reason)
                continue
            if isinstance(sample, RatioSample):
                speed_changes[label] = decide_speed(sample, len(labels))
            elif speed_changes:
                reason = f"--budget: its {MIN_SESSIONS} sessions take {sample:.0f} s"
                speed_changes[label] = SpeedChange("inconclusive", reason=reason)
            else:
                min_seconds = ceil(sample * len(labels))
                raise BaselineError(
                    f"--budget {budget:g}s: {MIN_SESSIONS} sessions of {len(labels)} trackers "
                    f"take about {min_seconds} s. Use --budget "
                    f"{min_seconds + min_seconds // 5}s, or select trackers with --trackers."
                )
    return dict(sorted(speed_changes.items(), key=lambda item: _ORDER.index(item[1].decision)))


def _setup(baseline: Baseline, label: str) -> Setup:
    name, options = split_text(baseline.specs[label])
    return Setup(name, {key: text for key, text in options.items() if key != "init"})


def _sample(
    label: str,
    setups: Sequence[Setup],
    clips: Sequence[Clip],
    deadline: float,
    tests: int,
    report: Callable[[str], None],
) -> RatioSample | float:
    """Run sessions until their number suffices for their spread, or until the deadline.

    If `MIN_SESSIONS` do not fit before the deadline, return their time instead [s].
    """
    started_at = monotonic()
    logs = [log_ratio(time_interleaved(setups, clips))]
    seconds = monotonic() - started_at
    if MIN_SESSIONS * seconds > deadline - started_at:
        return MIN_SESSIONS * seconds
    while n_missing := missing_sessions(logs, tests):
        seconds = monotonic() - started_at
        n_affordable = max(int((deadline - started_at - seconds) * len(logs) / seconds), 0)
        if len(logs) >= MIN_SESSIONS:
            report(
                f"{label}: {len(logs)} sessions in {seconds:.0f} s with a spread "
                f"of {ratio_sample(logs).spread:.1%}; {n_missing} more needed"
                + (": use a larger --budget." if n_missing > n_affordable else ".")
            )
        else:  # the first sessions fit; a slow one must not make the sample too small
            n_affordable = n_missing
        logs += [
            log_ratio(time_interleaved(setups, clips)) for _ in range(min(n_missing, n_affordable))
        ]
        if n_affordable < n_missing:
            break
    return ratio_sample(logs)


def _clips(baseline: Baseline, label: str, folder: Path) -> list[Clip]:
    """Write the first frames of a tracker's sequences into a new folder."""
    folder.mkdir()
    _, options = split_text(baseline.specs[label])
    sources = [score.source for score in baseline.scores[label].values()]
    indices = np.linspace(0, len(sources) - 1, min(CLIPS, len(sources))).round().astype(int)
    clips = [
        clip
        for index in indices.tolist()
        if (clip := _clip(sources[index], options.get("init", BOXES), label, folder / str(index)))
    ]
    if not clips:
        raise BaselineError(
            f"{label} cannot be timed: its sequences have one frame. Add a longer sequence."
        )
    return clips


def _clip(source: SequenceSpec, init: str, label: str, stem: Path) -> Clip | None:
    """Write the first frames of a sequence; None if it has one frame."""
    sequence = datasets.load(source.spec, truth=source.truth)
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
        n_frames=stop - first - 1,
        box=select_ground_truth(sequence, init, sequence.name).boxes[first].tolist(),
        mask="" if mask is None else f"{stem}-mask.npy",
        seed=run_seed(label, sequence.name, 0).spawn_key,
    )


def _spec_of_revision(revision: str, now: Setup, folder: Path) -> Setup:
    """Extract a tracker of a git revision, with the files next to it, into a folder.

    The extracted folder replaces the folder of the tracker's file on the module path. Modules of
    other packages are the current ones. For a tracker of trackmark the whole package `trackers` is
    extracted. Raises `BaselineError` if the tracker is not in the revision.
    """
    name = now.name
    location = in_file(name)
    if is_external(name, now.options or {}) or (location is None and is_outside(name)):
        raise BaselineError(
            f"{name} cannot be taken from {revision}: it runs in a process of its own, or comes "
            "from an installed package. --revision takes trackers in files and of trackmark itself."
        )
    if location is None:
        file, class_name = _PACKAGE / f"{name.replace('-', '_')}.py", ""
    else:
        file, class_name = location[0].resolve(), location[1]
    options = ("--verify", "--end-of-options", f"{revision}^{{commit}}")
    commit = _git(file.parent, "rev-parse", *options)
    # git packs only the files of the folder in which it runs, with paths relative to it.
    packed = _git(file.parent, "archive", "--format=tar", commit.decode().strip())
    target = folder / "trackers" if location is None else folder
    try:
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(target, filter="data")
    except (tarfile.TarError, OSError) as error:
        raise BaselineError(f"{revision} of {file.parent} cannot be extracted: {error}") from error
    then = target / file.name
    if not then.is_file():
        raise BaselineError(
            f"{revision} has no {file.name} in {file.parent}. Commit it first (git add "
            f"{file.name}; git commit), or give a revision that contains it."
        )
    if location is None:
        return replace(now, home=str(folder), revision=revision)
    name = f"{then}:{class_name}" if class_name else str(then)
    # The repository's packages are imported in their current version.
    swapped = () if file.parent == _PACKAGE.parent else (str(file.parent), str(folder))
    return replace(now, name=name, revision=revision, swapped=swapped)


def _git(folder: Path, *arguments: str) -> bytes:
    command = ["git", "-C", str(folder), *arguments]
    try:
        process = subprocess.run(command, capture_output=True, check=False)  # noqa: S603  # the user's arguments
    except OSError as error:
        raise BaselineError(f"--revision: cannot run git ({error}). Install git.") from error
    if process.returncode:
        message = "".join(process.stderr.decode(errors="replace").strip().splitlines()[-1:])
        if "single revision" in message:
            message = f"unknown revision {arguments[-1].removesuffix('^{commit}')!r}"
        raise BaselineError(f"--revision: git failed in {folder}: {message or 'no message'}.")
    return process.stdout


def speed_table(speed_changes: Mapping[str, SpeedChange]) -> Table:
    """Return the table of speeds."""
    return Table(
        name="speeds",
        caption="Change of the time of updates since the revision, with 95 % intervals.",
        headings=["", "tracker", "time", "95 %", "sessions"],
        n_labels=2,
        rows=[
            [Cell(text) for text in (speed_change.decision, label, *_figures(speed_change))]
            for label, speed_change in speed_changes.items()
        ],
        notes=[
            f"{label}: {speed_change.reason}."
            for label, speed_change in speed_changes.items()
            if speed_change.reason
        ],
        records=pd.DataFrame(speed_data(speed_changes)),
    )


def _figures(speed_change: SpeedChange) -> tuple[str, str, str]:
    if speed_change.reason:
        return MISSING, MISSING, MISSING
    return (
        f"{speed_change.change:+.1%}",
        f"{speed_change.low:+.1%} to {speed_change.high:+.1%}",
        str(speed_change.n_sessions),
    )


def speed_cases(speed_changes: Mapping[str, SpeedChange]) -> list[tuple[str, str, str]]:
    """Return tracker, state and message of each test case for JUnit's XML."""
    return [
        (
            label,
            speed_change.decision,
            speed_change.reason or "time {} ({})".format(*_figures(speed_change)),
        )
        for label, speed_change in speed_changes.items()
    ]


def speed_data(speed_changes: Mapping[str, SpeedChange]) -> list[dict[str, Any]]:
    """Return the fields of `--json`; only a tracker that was timed has numbers."""
    return [
        {"tracker": label, "decision": speed_change.decision, "reason": speed_change.reason}
        | ({} if speed_change.reason else asdict(speed_change))
        for label, speed_change in speed_changes.items()
    ]
