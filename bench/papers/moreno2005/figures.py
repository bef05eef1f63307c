"""The paper's figures, and pictures of our own.

Plots are those of `curves`: Fig. 1, Fig. 2, and region similarity over frames.
"""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.moreno2005.curves import density_figure, error_plot, similarity_plots
from bench.papers.stored import StoredRuns

__all__ = ["NUMBERS", "draw"]

NUMBERS = (1, 2)


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
        **similarity_plots(stored),
    }
    return write_pictures(folder, plots, {})
