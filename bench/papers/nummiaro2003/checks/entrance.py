"""Whether a target that is known by its histogram is found when it comes in (Fig. 3)."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centre_inside
from bench.papers.nummiaro2003.checks.running import PRESETS, tracker
from datasets import Sequence, SequenceError
from datasets.synthetic.nummiaro2003 import entries
from trackers.base.interface import Estimate
from trackers.base.sharing import SharedFrame
from trackers.nummiaro2003 import Nummiaro2003

__all__ = ["entered", "measure", "measure_kick_offs"]

AS_WRITTEN = 0.1  # the kick-off fraction b
KICK_OFFS = (0.05, AS_WRITTEN, 0.2, 0.4)
REPETITIONS = 20
FURTHER_REPETITIONS = 5
VISIBLE = 0.8
WHOLE = 0.99
IN_TIME = 10  # frames
WATCHED = 40  # frames from when the target is visible to the end
PICTURED = (-10, 0, IN_TIME)  # frames of the figure, from when it is visible


@dataclass
class _Run:
    """A tracker that waits, and what it says from the second frame on."""

    preset: str
    kick_off: float
    repetition: int
    tracker: Nummiaro2003
    estimates: list[Estimate] = field(default_factory=list)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `entrance` and those for Fig. 3; see `bench.papers.nummiaro2003.checks`."""
    regions = entries(sequence.name)
    runs = _waited(sequence, regions, (AS_WRITTEN,), 2 if quick else REPETITIONS)
    particles = list(_pictured(sequence, [run for run in runs if run.repetition == 0]))
    return {
        "entrance": _table(sequence, runs),
        "entrance_particles": pd.concat(particles, ignore_index=True),
        "entrance_regions": pd.DataFrame(regions, columns=["x", "y", "width", "height"]),
    }


def measure_kick_offs(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `kick_off`; see `bench.papers.nummiaro2003.checks`."""
    repetitions = 1 if quick else FURTHER_REPETITIONS
    runs = _waited(sequence, entries(sequence.name), KICK_OFFS, repetitions)
    return {"kick_off": _table(sequence, runs)}


def entered(
    tracking: NDArray[np.bool_], inside: NDArray[np.bool_], visibility: NDArray[np.float64]
) -> dict[str, float]:
    """What became of one run.

    Parameters
    ----------
    tracking, inside : ndarray of bool, shape (n,)
        In which frames it tracks, and the centre is inside; both false in the first.
    visibility : ndarray of float64, shape (n,)
        Of the target, 0 while it is absent; above .8 in some frame.

    Returns
    -------
    dict of str to float
        Columns of `entrance`.
    """
    empty = int(np.flatnonzero(visibility > 0)[0])
    visible = int(np.flatnonzero(visibility > VISIBLE)[0])
    begins = tracking & ~np.r_[False, tracking[:-1]]
    false_starts = float(np.count_nonzero(begins[:empty]))
    in_time = slice(empty, visible + IN_TIME + 1)
    # Of what it follows, where that began: what it took for the target before is not the target.
    since = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), -1))
    found = tracking & inside & (since >= empty)
    kept = tracking[visible + IN_TIME] and inside[visible + IN_TIME]
    tracks_from = np.flatnonzero(tracking[empty:])
    detected = np.flatnonzero(tracking[empty:] & inside[empty:])
    return {
        "empty_frames": float(empty),
        "false_starts": false_starts,
        "false_start_rate": 100 * false_starts / empty,
        "no_false_start": float(false_starts == 0),
        "visible_from": float(visible),
        "tracks_from": float(empty + tracks_from[0]) if len(tracks_from) else nan,
        "detected": float(empty + detected[0]) if len(detected) else nan,
        "started": float(kept or found[in_time].any()),
        "kept": float(kept),
    }


def _waited(
    sequence: Sequence,
    regions: NDArray[np.float64],
    kick_offs: tuple[float, ...],
    repetitions: int,
) -> list[_Run]:
    """Let trackers wait from the first frame on."""
    known = _known(sequence)
    box, view = sequence.boxes[known], sequence[known]
    image = sequence[0]
    runs = []
    for preset in PRESETS:
        for kick_off in kick_offs:
            for repetition in range(repetitions):
                waiting = tracker(sequence, repetition, preset=preset, kick_off=kick_off)
                histogram = waiting.histogram_of(view, box)
                waiting.init_by_histogram(image, histogram, box[2:] / 2, regions)
                runs.append(_Run(preset, kick_off, repetition, waiting))
    for frame in range(1, min(_visible_from(sequence) + WATCHED, len(sequence))):
        shown = SharedFrame(sequence[frame], len(runs))
        for run in runs:
            run.estimates.append(run.tracker.update_shared(shown))
    return runs


def _known(sequence: Sequence) -> int:
    """Frame of the model: the first in which the target is wholly visible, and in the light.

    "The object must be fully visible, so that a good color distribution can be calculated."
    """
    shade = sequence.attributes.get("shade", np.zeros(len(sequence), np.bool_))
    lit = np.flatnonzero(sequence.present & (sequence.visibility >= WHOLE) & ~shade)
    if len(lit) == 0:
        raise SequenceError(
            f"{sequence.name}: the target is never wholly visible in the light, so that its "
            "histogram is not known; take another scene."
        )
    return int(lit[0])


def _visible_from(sequence: Sequence) -> int:
    return int(np.flatnonzero(sequence.present & (sequence.visibility > VISIBLE))[0])


def _table(sequence: Sequence, runs: list[_Run]) -> pd.DataFrame:
    rows = []
    for run in runs:
        n = len(run.estimates) + 1
        boxes = np.array([estimate.box for estimate in run.estimates])
        inside = [False, *centre_inside(sequence.boxes[1:n], boxes)]
        tracking = [False, *(estimate.details["mode"] == 1 for estimate in run.estimates)]
        visibility = np.where(sequence.present, sequence.visibility, 0.0)[:n]
        rows.append(
            {"preset": run.preset, "kick_off": run.kick_off, "repetition": run.repetition}
            | entered(np.array(tracking), np.array(inside), visibility)
        )
    return pd.DataFrame(rows)


def _pictured(sequence: Sequence, runs: list[_Run]) -> Iterator[pd.DataFrame]:
    """Particles of some frames, and of the one in which the target is found."""
    for run in runs:
        modes = [estimate.details["mode"] for estimate in run.estimates]
        found = {modes.index(1.0) + 1} if 1.0 in modes else set()
        for frame in sorted(found | {_visible_from(sequence) + offset for offset in PICTURED}):
            estimate = run.estimates[frame - 1]
            particles = estimate.arrays["particles"][:, [0, 1, 4, 5]]
            yield pd.DataFrame(particles, columns=["x", "y", "half_width", "half_height"]).assign(
                preset=run.preset,
                frame=frame,
                tracking=estimate.details["mode"],
                weight=estimate.arrays["weights"],
            )
