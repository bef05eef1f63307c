"""The paper's figures, and pictures of our own.

Plots of numbers are those of `curves`: Fig. 1, Fig. 2, and region similarity over frames. Fig. 4 is
a flow chart. Those of one step of the tracker, and film strips, are drawn for both presets.
"""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.moreno2005.colour_model import colour_model_figure, colour_path_figure
from bench.papers.moreno2005.curves import METHODS, density_figure, error_plot, similarity_plots
from bench.papers.moreno2005.hypotheses import hypotheses_figure
from bench.papers.moreno2005.one_step import step_of
from bench.papers.moreno2005.snake_stages import snake_figure
from bench.papers.moreno2005.strips import PRESETS, film_strips
from bench.papers.stored import StoredRuns

__all__ = ["NUMBERS", "draw"]

NUMBERS = (1, 2, 3, 5, 6, 7, 8, 9, 10)


def draw(
    results: Path, folder: Path, asked: Asked, tables: Mapping[str, pd.DataFrame]
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
        `one-dimensional-errors`.
    """
    stored = StoredRuns(results, asked)
    plots = {
        "figure-1": density_figure(),
        "figure-2": error_plot(tables),
        "figure-3": colour_model_figure(),
        **_one_step(),
        "figure-7-colours": colour_path_figure(),
        **similarity_plots(stored),
    }
    return write_pictures(folder, plots, film_strips(stored))


def _one_step() -> dict[str, Figure]:
    """Fig. 5 and 6 by name."""
    figures = {}
    for ending, label in PRESETS.items():
        step = step_of(METHODS[label])
        figures[f"figure-5{ending}"] = hypotheses_figure(step, label)
        figures[f"figure-6{ending}"] = snake_figure(step, label)
    return figures
