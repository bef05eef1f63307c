"""Motion and drift apart, from which section 3.2 draws two conclusions: both, one and neither.

All with one number of particles and one radius, on all three sequences.
"""

import pandas as pd

from bench.claims.ledger import ANY
from bench.papers.tables import text_table
from bench.papers.wang2010.scores import FILTER, PROPOSED, RULE
from bench.papers.wang2010.sensitivities import COLUMNS, outcome_words
from reports.tables import MISSING, Table

__all__ = ["crossed", "crossed_table"]

PARTICLES = 60
FOUR = [(tracker, model) for tracker in (PROPOSED, FILTER) for model in ("fused", "colour")]

_CELL = ["sequence", "scene", "repetition", "preset", "variant", "radius"]
_MOTION = {"fused": "β = 0.8", "colour": "β = 0", "hue": "β = 0, hue alone"}
_RADII = {15: "1.94", 60: "3.87"}  # √N / 2


def crossed(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs with 60 particles that make a complete 2 x 2: table `wa-26` of the ledger.

    Parameters
    ----------
    scores : DataFrame
        See `scores.tidy_scores`.

    Returns
    -------
    DataFrame
        `sequence`, `scene`, `repetition`, `preset`, `variant`, `radius`, `tracker`, `model`,
        `centre_error`. There are all four of a scene, a repetition and a reading, or none.
    """
    runs = _of_one_radius(scores)
    runs = runs[runs["model"].isin(["fused", "colour"]) & (runs["particles"] == PARTICLES)]
    ways = runs["tracker"] + " " + runs["model"]
    found = ways.groupby([runs[column] for column in _CELL]).transform("nunique")
    columns = [*_CELL, "tracker", "model", "centre_error"]
    return runs.loc[found == len(FOUR), columns].reset_index(drop=True)


def crossed_table(scores: pd.DataFrame) -> Table:
    """Motion by drift, on every sequence, and the same of hue alone."""
    runs = _of_one_radius(scores)
    runs = runs[(runs["variant"] == "") & (runs["radius"] == RULE)]
    data = []
    for number, radius in sorted(_RADII.items(), reverse=True):
        for preset in ("as-written", "recommended"):
            for model, motion in _MOTION.items():
                for tracker, drift in ((PROPOSED, "yes"), (FILTER, "no")):
                    chosen = runs[(runs["particles"] == number) & (runs["preset"] == preset)]
                    chosen = chosen[(chosen["model"] == model) & (chosen["tracker"] == tracker)]
                    labels = {
                        "N": str(number),
                        "r [px]": radius,
                        "preset": preset,
                        "motion": motion,
                        "drift": drift,
                    }
                    cells = {words: outcome_words(chosen, name) for words, name in COLUMNS.items()}
                    if set(cells.values()) != {MISSING}:
                        data.append(labels | cells)
    return text_table(
        "motion-and-drift",
        "Motion and drift apart (section 3.2), with one number of particles and one radius: "
        "success in %, median of the mean centre error [px]; the paper has 60 "
        "particles, 15 on the cup",
        data,
        n_labels=5,
    )


def _of_one_radius(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs of both filters whose radius is what N gives, or is one for both."""
    runs = scores[scores["tracker"].isin([PROPOSED, FILTER])]
    return runs[runs["reach"].isin([RULE, ANY]) & (runs["preset"] != "robust")]
