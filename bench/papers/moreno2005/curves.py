"""Fig. 1 and 2 of the paper, and J over frames, which it has not."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bench.papers.moreno2005 import FIGURES, LIGHT
from bench.papers.moreno2005.one_dimensional.moments import GRIDS, iteration
from bench.papers.moreno2005.one_dimensional.settings import SETTINGS
from bench.papers.scores import sequence_labels
from bench.papers.stored import StoredRuns
from bench.statistics.intervals import mean_interval
from reports.curves import curve_plot
from reports.densities import Densities, density_plot
from reports.series import series_grid

__all__ = ["density_figure", "error_plot", "similarity_plots"]

FILTERS = {
    "observation": "observation",
    "independent": "independent features",
    "dependent": "dependent features",
    "unweighted": "dependent, whatever the weights (not in the paper)",
}

METHODS = {
    "as written": "moreno2005:preset=as-written",
    "recommended (post hoc)": "moreno2005",
    "robust (post hoc)": "moreno2005:preset=robust",
    "uniform association": "moreno2005:association=uniform",
    "smooth colour, a = 1": "contour-smooth-color",
    "smooth colour, a = 0.5": "contour-smooth-color:mixing=0.5",
    "smooth colour, a = 0.3": "contour-smooth-color:mixing=0.3",
}
"""Of the plots of J, by what the legend says."""

PLOTS = {
    "similarity-ellipse": {
        "repeated jumps": (LIGHT, "moreno2005/ellipse:light=repeated"),
        "one jump": (LIGHT, "moreno2005/ellipse:light=jump"),
        "even light": (FIGURES[7], "moreno2005/ellipse"),
    },
    "similarity-figures": {
        "book": (FIGURES[9], "moreno2005/book"),
        "leaf, jump at the start": (FIGURES[10], "moreno2005/leaf:jump=start"),
        "leaf, at mid-sequence": (FIGURES[10], "moreno2005/leaf:jump=middle"),
        "octopus": (FIGURES[8], "moreno2005/octopus"),
    },
}
"""Columns of the plots of J: experiment, and sequence without its scene.

The legend is that of the first, which has runs of all methods.
"""


def density_figure() -> Figure:
    """Fig. 1: the densities that take part in one iteration of the example."""
    before, after = iteration()
    times = {
        when: Densities(
            moment.colour,
            moment.position,
            moment.both,
            {
                f"true, {when}": moment.truth,
                f"estimated, {when}": moment.estimate,
                f"observed, {when}": moment.observed,
            },
        )
        for when, moment in (("t - 1", before), ("t", after))
    }
    return density_plot(
        "Fig. 1, another course: densities of one iteration, p₁ of the colour, p₂ of the position, "
        "and P of both; 500 samples, λ = 1",
        times,
        GRIDS,
        ("colour", "position"),
    )


def error_plot(tables: Mapping[str, pd.DataFrame]) -> Figure:
    """Fig. 2: errors against the number of samples, by set of parameters.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        `one-dimensional-errors`.
    """
    errors = tables["one-dimensional-errors"]
    rows = []
    for (name, number, kind), runs in errors.groupby(["set", "samples", "filter"], sort=False):
        interval = mean_interval(runs["error"])
        setting = SETTINGS[str(name)]
        rows.append(
            {
                "panel": f"{name}: λ = {setting.scale:g}, σ_obs = {setting.observed[0]:g}",
                "label": FILTERS[str(kind)],
                "setting": number,
                "value": runs["error"].mean(),
                "low": interval.low,
                "high": interval.high,
            }
        )
    return curve_plot(
        pd.DataFrame(rows),
        "Fig. 2, other parameters: error of position and colour; the paper's curves can't be read. "
        "λ = 1 is printed, λ = 0.2 was tuned",
        "number of samples",
        "error",
        list(FILTERS.values()),
        heading=f"means and 95 % intervals over {errors['repetition'].nunique()} repetitions",
        ticks=range(0, 501, 100),
    )


def similarity_plots(stored: StoredRuns) -> dict[str, Figure | None]:
    """J over frames by method, medians and quartiles over scenes; None without runs."""
    return {name: _similarity(stored, columns) for name, columns in PLOTS.items()}


def _similarity(stored: StoredRuns, columns: Mapping[str, tuple[str, str]]) -> Figure | None:
    pieces = [pd.DataFrame()]
    for words, (experiment, sequence) in columns.items():
        wanted = sequence_labels(sequence)
        for name in stored.sequences(experiment):
            labels = sequence_labels(name)
            scene = labels["scene"]
            if labels | {"scene": wanted["scene"]} != wanted:
                continue
            for label, text in METHODS.items():
                for values in _means(stored, experiment, name, text):
                    rows = pd.DataFrame({"value": values, "label": label, "repetition": scene})
                    pieces.append(rows.assign(frame=rows.index, reading="", scene=words))
    if len(pieces) == 1:
        return None
    return series_grid(
        pd.concat(pieces[1:], ignore_index=True),
        "Region similarity over frames, other videos; no published numbers",
        "J",
        list(METHODS),
        {},
        over="scenes",
        row_height=3.0,
    )


def _means(
    stored: StoredRuns, experiment: str, name: str, text: str
) -> "list[np.ndarray[tuple[int], np.dtype[np.float64]]]":
    """J by frame, the mean over repetitions; none without runs."""
    runs = [run.segmentation for run in stored.of(experiment, name, text)]
    found = [one.region_similarity for one in runs if one is not None]
    return [np.mean(found, axis=0)] if found else []
