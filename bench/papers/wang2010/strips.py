"""The paper's Fig. 3, 5 and 6: film strips of the frames that it shows, a row a method."""

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error
from bench.papers.stored import StoredRuns
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.methods import EXPERIMENTS, every_method
from reports.film_strip import film_strip
from reports.overlay import TRUTH
from reports.palette import colours

__all__ = ["film_strips"]

FRAMES = {
    TABLE_TENNIS: (10, 11, 12, 16),
    HAND: (10, 38, 49, 58),
    CUP: (18, 36, 44, 51),
}
"""Those of the paper, counted from 1."""

STRIPS = {
    "figure-3": (TABLE_TENNIS, "as written"),
    "figure-3-recommended": (TABLE_TENNIS, "recommended"),
    "figure-5": (HAND, "as written"),
    "figure-6": (CUP, "as written"),
    "figure-6-recommended": (CUP, "recommended"),
}
"""By name: sequence and preset."""

ENLARGED = 3.0

Strip = NDArray[np.uint8]


def film_strips(stored: StoredRuns) -> dict[str, Strip]:
    """Strips of the first scene and repetition, by name; none where there is no run."""
    strips = {}
    for name, (sequence, preset) in STRIPS.items():
        runs = {
            label: found[0]
            for label, tracker in every_method(sequence, preset).items()
            if (found := stored.of(EXPERIMENTS[sequence], sequence, tracker))
        }
        if runs:
            title = f"Fig. {name.split('-')[1]}, {preset}, {sequence}, scene 0, first repetition"
            strips[name] = _strip(stored, sequence, runs, f"{title}: frame (centre error)")
    return strips


def _strip(stored: StoredRuns, name: str, runs: dict[str, Run], title: str) -> Strip:
    """A row of frames for each method, its boxes beside the truth's."""
    sequence, frames = datasets.load(name), [frame - 1 for frame in FRAMES[name]]
    shades = colours(list(runs))
    rows: list[Strip] = []
    for label, run in runs.items():
        truth = stored.truth(EXPERIMENTS[name], run).boxes
        errors = centre_error(truth, run.boxes)
        rows.append(
            film_strip(
                sequence.__getitem__,
                frames,
                {TRUTH: truth, label: run.boxes},
                "" if rows else title,
                len(frames),
                round(ENLARGED * sequence[0].shape[1] * len(frames)),
                shades=shades,
                words={frame: f"({errors[frame]:.1f} px)" for frame in frames},
                count_from=1,
            )
        )
    return np.vstack(rows)
