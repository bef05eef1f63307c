"""Section 3 in figures: errors of both filters, where they come from, how samples are paired."""

from collections.abc import Mapping

import pandas as pd

from bench.papers.moreno2005.example import SETTINGS
from bench.papers.moreno2005.tables import UNPUBLISHED
from bench.papers.tables import text_table
from reports.tables import Table

__all__ = ["association_table", "factorisation_table", "simulation_table"]

SHOWN = (5, 10, 20, 50, 100, 200, 500)
"""Numbers of samples in the table; the figure has all."""

FILTERS = ("observation", "independent", "dependent", "unweighted")

_PARTS = ("position_error", "colour_error", "own_colour_error")


def simulation_table(tables: Mapping[str, pd.DataFrame]) -> Table:
    """Errors by set and number, paired differences, and the parts of the error.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        `one-dimensional-errors` and `-differences`; see `example_tables`.
    """
    errors = tables["one-dimensional-errors"]
    differences = tables["one-dimensional-differences"]
    repetitions = errors["repetition"].nunique()
    data = []
    for (name, number), rows in errors.groupby(["set", "samples"], sort=False):
        if number not in SHOWN:
            continue
        by_filter = rows.groupby("filter")
        means, spreads = by_filter["error"].mean(), by_filter["error"].sem()
        paired = differences[(differences["set"] == name) & (differences["samples"] == number)]
        gain = paired[
            (paired["pair"] == "independent less dependent") & (paired["quantity"] == "error")
        ].iloc[0]
        effective = by_filter["effective"].mean()
        data.append(
            {
                "set": _setting_words(str(name)),
                "samples": str(number),
                **{one: f"{means[one]:.4f}±{spreads[one]:.4f}" for one in FILTERS},
                "independent less dependent": f"{gain['mean']:+.4f}±{gain['standard_error']:.4f}",
                **{
                    f"{part.replace('_', ' ')}, independent / dependent": " / ".join(
                        f"{by_filter[part].mean()[one]:.3f}" for one in FILTERS[1:3]
                    )
                    for part in _PARTS
                },
                "effective positions, independent / dependent": " / ".join(
                    f"{effective[one]:.2f}" for one in FILTERS[1:3]
                ),
            }
        )
    return text_table(
        "figure-2",
        f"Fig. 2, one dimension: error in the plane of position and colour, means over "
        f"{repetitions} repetitions ± standard errors; differences are paired. Unweighted: colours "
        "of the filter whatever their weights, which is not in the paper. Own colour error: of the "
        f"colour filter's own estimate. {UNPUBLISHED.capitalize()} (the curves can't be read)",
        data,
        n_labels=2,
    )


def association_table(association: pd.DataFrame) -> Table:
    """How the best samples of both features go together."""
    means = association.groupby(["set", "association"], sort=False)[["best", "top_pairs"]].mean()
    data = [
        {
            "set": _setting_words(row["set"]),
            "association": row["association"],
            "weight of the best position's colour, in mean weights": f"{row['best']:.3f}",
            "of the best tenth, with one of the best tenth of colours": f"{row['top_pairs']:.3f}",
        }
        for row in means.reset_index().to_dict("records")
    ]
    return text_table(
        "association",
        "Section 1, one dimension: whether association by weight brings the best samples together. "
        + UNPUBLISHED.capitalize(),
        data,
        n_labels=2,
    )


def factorisation_table(factorisation: pd.DataFrame) -> Table:
    """How far the product of equation 2 is from the posterior."""
    data = [
        {"assumed": str(row["dependence"]), "greatest total variation": f"{row['distance']:.2g}"}
        for _, row in factorisation.iterrows()
    ]
    return text_table(
        "equation-2",
        "Equation 2 on 100 random models of two features with four states each: posterior and "
        "product. The proof needs that the second measurement tells nothing of the first feature, "
        "which equation 1 does not say",
        data,
        n_labels=1,
    )


def _setting_words(name: str) -> str:
    setting = SETTINGS[name]
    tuned = ", tuned" if setting.scale != 1 else ""
    return f"{name}: λ = {setting.scale:g}{tuned}, σ_obs = {setting.observed[0]:g}"
