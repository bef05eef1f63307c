"""The paper's Fig. 1 and 3 to 6 (Fig. 2 is a flow chart), and pictures of our own."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

import datasets
from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.stored import StoredRuns
from bench.papers.wang2010.courses import TABLE_TENNIS
from bench.papers.wang2010.curves import error_plots, particle_plot, sample_size_plot, time_plot
from bench.papers.wang2010.plain import PlainImprovedCamShift
from bench.papers.wang2010.strips import film_strips
from reports.maps import Panel, map_plot

__all__ = ["NUMBERS", "draw"]

NUMBERS = (1, 3, 4, 5, 6)

FRAME = 12
"""Of Fig. 1, which shows it and the one before, counted from 1."""


def draw(
    results: Path,
    folder: Path,
    asked: Asked,
    tables: Mapping[str, pd.DataFrame],
    scores: pd.DataFrame,
) -> list[Path]:
    """Draw all pictures whose runs were asked for and are there.

    Parameters
    ----------
    results : Path
        Folder of all experiments.
    folder : Path
        Where to.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    tables : mapping of str to DataFrame
        Of `timing.measured_times` `particle_times`.
    scores : DataFrame
        See `scores.tidy_scores`; those of `wang2010-figure-3` and `wang2010-particles` are drawn.
    """
    stored = StoredRuns(results, asked)
    plots = {
        "figure-1": _maps(TABLE_TENNIS),
        **error_plots(stored),
        "particles": particle_plot(scores),
        "particles-time": time_plot(tables["particle_times"]),
        "sample-size": sample_size_plot(stored),
    }
    return write_pictures(folder, plots, film_strips(stored))


def _maps(name: str) -> Figure:
    """Fig. 1: two frames, and the maps of the second."""
    sequence = datasets.load(name)
    tracker = PlainImprovedCamShift()
    tracker.init(sequence[0], sequence.boxes[0])
    for index in range(1, FRAME):
        tracker.update(sequence[index])
    maps, box = tracker.maps, sequence.boxes[FRAME - 1]
    panels = [
        Panel(f"frame {FRAME - 1}", sequence[FRAME - 2], sequence.boxes[FRAME - 2]),
        Panel(f"frame {FRAME}", sequence[FRAME - 1], box),
        Panel("B: what moves", maps.moving.astype(float), box),
        Panel("colour, I_c", maps.colour, box),
        Panel("motion, I_m = B I_c", maps.moving * maps.colour, box),
        Panel("both, P", maps.joint, box),
    ]
    title = (
        f"Fig. 1, {name}: frames, and maps of frame {FRAME} (black: 0, white: 1), with the true box"
    )
    return map_plot(panels, title, 3)
