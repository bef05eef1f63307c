"""The paper's Fig. 1, and pictures of our own."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.nguyen2002.curves import loss_plot, outlier_plot, overlap_plot, sign_plot
from bench.papers.nguyen2002.strips import film_strips
from bench.papers.stored import StoredRuns

__all__ = ["NUMBERS", "draw"]

NUMBERS = (1,)


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
        Of what `checks` measures, `ng-15`.
    scores : DataFrame
        See `scores.tidy_scores`; those of the recording are drawn.
    """
    stored = StoredRuns(results, asked)
    plots = {
        "lights-overlap": overlap_plot(stored),
        "lights-outliers": outlier_plot(stored),
        "lights-losses": loss_plot(scores),
        "outliers-as-sign": sign_plot(tables),
    }
    return write_pictures(folder, plots, film_strips(stored))
