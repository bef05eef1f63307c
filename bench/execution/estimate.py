"""Estimate of the time that the missing runs of a plan take, from stored runs of its trackers."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import numpy as np

from trackmark.bench.execution.plan import Tasks
from trackmark.bench.store.database import FILE_NAME, ResultsError, open_database

_MEASURED = """
    SELECT tracker, avg(seconds / max(frames, 1)), avg(reading_seconds) FROM run
    WHERE status = 'finished' AND seconds IS NOT NULL GROUP BY tracker
"""


@dataclass(frozen=True)
class TimeEstimate:
    """Estimated time of missing runs."""

    seconds: float  # wall time of the runs of measured trackers [s]
    without_times: list[str]  # labels of the trackers without stored runs, which are not included


def estimate_time(tasks: Tasks, results_root: Path) -> TimeEstimate:
    """Estimate the time of tasks from finished runs of all experiments in a results folder."""
    plan = tasks.plan
    # Frames that each tracker has to process.
    tracker_frames = np.zeros(len(plan.trackers), np.int64)
    np.add.at(tracker_frames, plan.run_trackers, plan.n_frames @ tasks.requested)
    update_seconds, reading_seconds = _read_measured_times(results_root)
    seconds, without_times = 0.0, []
    for spec, frames in zip(plan.trackers.values(), tracker_frames.tolist(), strict=True):
        if spec.label in update_seconds:
            seconds += frames * fmean(update_seconds[spec.label])
        elif frames:
            without_times.append(spec.label)
    if reading_seconds and seconds:
        seconds += sum(task.n_frames for task in tasks) * fmean(reading_seconds)
    return TimeEstimate(seconds / tasks.n_workers, without_times)


def _read_measured_times(results_root: Path) -> tuple[dict[str, list[float]], list[float]]:
    """Return mean times of an update by tracker, and of reading a frame [s], in each experiment."""
    update_seconds: dict[str, list[float]] = {}
    reading_seconds: list[float] = []
    for file in sorted(results_root.glob(f"*/{FILE_NAME}")):
        with suppress(ResultsError), open_database(file.parent) as database:  # skips damaged files
            for tracker, seconds, reading in database.select(_MEASURED):
                update_seconds.setdefault(tracker, []).append(seconds)
                if reading is not None:
                    reading_seconds.append(reading)
    return update_seconds, reading_seconds
