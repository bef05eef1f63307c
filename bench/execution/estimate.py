"""Estimate of the time that the missing runs of a plan take, from stored runs of its trackers."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import numpy as np

from trackmark.bench.execution.scheduling import Units
from trackmark.bench.store.database import open_database
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE

_MEASURED = """
    SELECT tracker, avg(seconds / max(frames, 1)), avg(frame_seconds) FROM run
    WHERE status = 'finished' AND seconds IS NOT NULL GROUP BY tracker
"""


@dataclass(frozen=True)
class Estimate:
    """Estimated time of missing runs."""

    seconds: float  # wall time of the runs of measured trackers [s]
    unmeasured: list[str]  # labels of the trackers without stored runs, which are not included


def estimate(units: Units, output: Path) -> Estimate:
    """Estimate the time of work units from finished runs of all experiments in a results folder."""
    plan = units.plan
    # Frames that each tracker has to process.
    tracker_frames = np.zeros(len(plan.trackers), np.int64)
    np.add.at(tracker_frames, plan.run_trackers, plan.frames @ units.wanted)
    update_seconds, frame_seconds = _read_measured_times(output)
    seconds, unmeasured = 0.0, []
    for spec, frames in zip(plan.trackers.values(), tracker_frames.tolist(), strict=True):
        if spec.label in update_seconds:
            seconds += frames * fmean(update_seconds[spec.label])
        elif frames:
            unmeasured.append(spec.label)
    if frame_seconds and seconds:
        seconds += sum(unit.frames for unit in units) * fmean(frame_seconds)
    return Estimate(seconds / units.workers, unmeasured)


def _read_measured_times(output: Path) -> tuple[dict[str, list[float]], list[float]]:
    """Return mean times of an update by tracker, and of reading a frame [s], in each experiment."""
    update_seconds: dict[str, list[float]] = {}
    frame_seconds: list[float] = []
    for file in sorted(output.glob(f"*/{DATABASE}")):
        with suppress(ResultsError), open_database(file.parent) as database:  # skips damaged files
            for tracker, seconds, reading in database.select(_MEASURED):
                update_seconds.setdefault(tracker, []).append(seconds)
                if reading is not None:
                    frame_seconds.append(reading)
    return update_seconds, frame_seconds
