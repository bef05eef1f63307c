"""The paper's Fig. 6, 8 and 10: film strips with ellipses of the mean state and of the truth."""

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.papers.nummiaro2003.stored import UPDATE, AdaptiveRuns
from datasets import Sequence
from reports.film_strip import evenly_spaced, film_strip
from reports.overlay import TRUTH
from reports.palette import colour

__all__ = ["film_strips"]

STUDENTS, TRAFFIC, HEAD = (f"nummiaro2003/{name}" for name in ("students", "traffic", "head"))
PAPERS_FRAME = 101
"""Of Fig. 6, in which the tree hides the target; counted from the first with the target."""

COLUMNS = 6
SHADES = {label: colour(position) for position, label in enumerate(UPDATE)}

Strip = NDArray[np.uint8]


def film_strips(stored: AdaptiveRuns) -> dict[str, Strip]:
    """Strips of the first repetition, by name; none where there is no run."""
    rows = {
        "figure-6": ("nummiaro2003-figure-6", STUDENTS, 2 * COLUMNS, "Fig. 6, as written"),
        "figure-8": ("nummiaro2003-figure-8", TRAFFIC, COLUMNS, "Fig. 8, as written"),
    }
    strips = {}
    for name, (experiment, sequence, n_frames, title) in rows.items():
        parts = _one_above_the_other(stored, experiment, sequence, n_frames, title)
        if parts:
            strips[name] = np.vstack(parts)
    both = {
        label: runs[0]
        for label, runs in stored.by_update("nummiaro2003-figure-10", HEAD).items()
        if runs
    }
    if both:
        head = datasets.load(HEAD)
        truth = stored.truth("nummiaro2003-figure-10", next(iter(both.values()))).boxes
        frames = _frames(head, 2 * COLUMNS)
        strips["figure-10"] = _strip(head, both, truth, "Fig. 10, as written", frames)
    return strips


def _one_above_the_other(
    stored: AdaptiveRuns, experiment: str, name: str, n_frames: int, title: str
) -> list[Strip]:
    """Strips without update, then those with."""
    parts = []
    for label, runs in stored.by_update(experiment, name).items():
        for run in runs[:1]:
            sequence = datasets.load(name)
            truth = stored.truth(experiment, run).boxes
            frames = _frames(sequence, n_frames)
            parts.append(_strip(sequence, {label: run}, truth, f"{title}, {label}", frames))
    return parts


def _frames(sequence: Sequence, number: int) -> list[int]:
    """Evenly spaced from the first with the target on; of `students` the paper's among them."""
    first = sequence.first_frame
    if sequence.name != STUDENTS:
        return evenly_spaced(first, len(sequence) - 1, number)
    others = evenly_spaced(first, len(sequence) - 1, number - 1)
    return sorted({*others, first + PAPERS_FRAME})


def _strip(
    sequence: Sequence,
    runs: dict[str, Run],
    truth: NDArray[np.float64],
    title: str,
    frames: list[int],
) -> Strip:
    """Frames with ellipses; where there is one run, its mode is said."""
    words = {}
    if len(runs) == 1:
        (run,) = runs.values()
        words = {frame: "initialising" for frame in frames if run.details["mode"][frame] == 0}
    return film_strip(
        sequence.__getitem__,
        frames,
        {TRUTH: truth} | {label: run.boxes for label, run in runs.items()},
        f"{title}, {sequence.name}, first repetition",
        COLUMNS,
        shape="ellipse",
        shades=SHADES,
        words=words,
    )
