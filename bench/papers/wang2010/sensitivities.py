"""What decides the outcome: one parameter at a time beside what is as written."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from bench.claims.ledger import ANY
from bench.papers.tables import failed_words, number_words, share_words, text_table
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import CAMSHIFT, FILTER, IMPROVED, PROPOSED, RULE
from bench.papers.wang2010.tables import HINDSIGHT, TRACKERS
from datasets.text_form import parse_text
from reports.tables import MISSING, Table

__all__ = ["COLUMNS", "further_table", "outcome_words", "sensitivities_table"]

AS_WRITTEN = "as written"

SENSITIVE = {
    AS_WRITTEN: "",
    "difference_window": "n, window of the differences",
    "sigma": "σ",
    "radius": "r [px]",
    "alpha": "α",
    "beta": "β",
    "threshold_factor": "λ",
    "stop_distance": "ε [px]",
    "max_iterations": "n₀, most iterations",
}
"""Parameters that the paper leaves open, or gives without trying others, in the table's order."""

COLUMNS = {"table-tennis": TABLE_TENNIS, "hand": HAND, "cup": CUP}
"""Sequences, by head."""


def sensitivities_table(scores: pd.DataFrame) -> Table:
    """Success and error by parameter, for all trackers on all three sequences.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`.
    """
    return _table(
        "sensitivities",
        "What decides the outcome and the paper leaves open, or gives without trying others: one "
        "value at a time, otherwise as written (n = 5, σ = 1, r by the formula: 3.87, on the cup "
        "1.94, of the traditional filter 10; α = 0.7, β = 0.8, λ = 2, ε = 2, n₀ = 10, and 11 "
        "where n₁ > n₀ is read literally). Success in %, median of the "
        "mean centre error [px]. σ = 0.2, and r = 10 for the proposed filter, were chosen after "
        "seeing results",
        _one_changed(scores),
        list(SENSITIVE),
    )


def further_table(scores: pd.DataFrame) -> Table:
    """The same of whatever else the text leaves open."""
    changed = _one_changed(scores)
    others = sorted(set(changed["parameter"]).difference(SENSITIVE))
    return _table(
        "readings",
        "What else the text leaves open, one choice at a time: success in %, median of the mean "
        "centre error [px]",
        changed,
        [AS_WRITTEN, *others],
    )


def _one_changed(scores: pd.DataFrame) -> pd.DataFrame:
    """Runs as written but for one parameter: `parameter`, `value` beside the scores."""
    usual = scores[scores["budget"].isin(["paper", ANY]) & (scores["model"] != "hue")]
    ways = ["preset", "variant", "model", "radius", "reach"]
    pieces = []
    for _, runs in usual.groupby(ways, sort=False):
        changed = _changed(runs.iloc[0])
        if changed is not None:
            pieces.append(runs.assign(parameter=changed[0], value=changed[1]))
    empty = scores.iloc[:0].assign(parameter="", value="")
    return pd.concat(pieces, ignore_index=True) if pieces else empty


def _changed(run: "Mapping[str, Any] | pd.Series[Any]") -> tuple[str, str] | None:
    """The one parameter that is not as written, with its value; None where there are more."""
    options: dict[str, str] = {}
    if run["variant"] not in ("", ANY):
        options |= parse_text(f":{run['variant']}")[1]
    if run["model"] == "colour":
        options["beta"] = "0"
    elif run["model"] not in ("fused", ANY):
        options |= parse_text(f":{run['model']}")[1]
    for column in ("radius", "reach"):
        if run[column] not in (RULE, ANY):
            options["radius"] = run[column]
    if run["preset"] == "recommended":
        options["sigma"] = "0.158"
    elif run["preset"] == "robust":
        return None
    if len(options) > 1 and len(set(options.values())) > 1:
        return None
    return (" = ".join(options), next(iter(options.values()))) if options else (AS_WRITTEN, "")


def _table(name: str, caption: str, changed: pd.DataFrame, parameters: list[str]) -> Table:
    data = []
    for tracker in (PROPOSED, FILTER, IMPROVED, CAMSHIFT):
        here = changed[changed["tracker"] == tracker]
        for window, runs in here.groupby("window", sort=False):
            told = TRACKERS[tracker] + ("" if window == ANY else f", {window} window")
            for parameter in parameters:
                rows = runs[runs["parameter"] == parameter]
                for value in sorted(rows["value"].unique(), key=_order):
                    chosen = rows[rows["value"] == value]
                    data.append(
                        {
                            "tracker": told,
                            "parameter": SENSITIVE.get(parameter, parameter) or parameter,
                            "value": _marked(tracker, parameter, value),
                        }
                        | {words: outcome_words(chosen, name) for words, name in COLUMNS.items()}
                    )
    return text_table(name, caption, data, n_labels=3)


def _order(value: str) -> tuple[float, str]:
    """Numbers by size, before words."""
    try:
        return float(value), ""
    except ValueError:
        return float("inf"), value


def _marked(tracker: str, parameter: str, value: str) -> str:
    is_ours = parameter == "sigma" or tracker == PROPOSED
    chosen = is_ours and f"{parameter}={value}" in HINDSIGHT
    return f"{value} (post hoc)" if chosen else value


def outcome_words(rows: pd.DataFrame, sequence: str) -> str:
    """Success and error on a sequence; a dash where nothing was run."""
    here = rows[rows["sequence"] == sequence]
    if here.empty:
        return MISSING
    return failed_words(here) or (
        f"{share_words(here, 'success')} %, {number_words(here['centre_error'].median(), 1)} px"
    )
