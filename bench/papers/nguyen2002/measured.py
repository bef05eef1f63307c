"""What was measured on the scenes, in figures, by features."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import pandas as pd

from bench.papers.tables import number_words, text_table
from reports.tables import Table

__all__ = ["measured_table"]


HEADS = {"intensity": "intensity", "rgb": "RGB", "invariants": "c1c2c3", "arctan": "arctan"}
"""Of the table, by features."""


WORDS: Mapping[tuple[str, object], str] = {
    ("hidden", 0.0): "less than half hidden",
    ("hidden", 1.0): "half hidden or more",
}
"""Values by which there are rows that do not speak for themselves, by column."""


class Quantity(NamedTuple):
    """A column of a table of `checks`, told apart by others.

    Attributes
    ----------
    table : str
        Its name.
    metric : str
        The column.
    words : str
        What it is.
    by : tuple of str
        Columns by whose values there are rows.
    digits : int
    """

    table: str
    metric: str
    words: str
    by: tuple[str, ...] = ()
    digits: int = 2


QUANTITIES = (
    Quantity("ng-9", "margin", "least cost in clutter less that at the target, a pixel"),
    Quantity("ng-9", "false_alarms", "share of the pixels there that pass for the target's"),
    Quantity("ng-11", "template_error", "template's error by partial occlusion, gate", ("gate",)),
    Quantity("ng-11", "overlap", "overlap by partial occlusion, gate", ("gate",), 3),
    Quantity("ng-12", "flagged", "share of outliers", ("part",), 3),
    Quantity("ng-13", "flagged", "outliers after a lasting change, re-bootstrap", ("rebootstrap",)),
    Quantity("ng-14", "state_noise", "C_w over R̄, adaptive", ("adaptive", "phase"), 3),
    Quantity("ng-14", "gain", "gain, adaptive", ("adaptive", "phase"), 3),
    Quantity("ng-14", "template_error", "template's error, adaptive", ("adaptive", "phase")),
    Quantity("ng-15", "exceeds", "share of frames with more than γ outliers,", ("hidden",)),
    Quantity("ng-16", "contaminated", "of the template covered as declared, speed", ("speed",)),
    Quantity("ng-16-targets", "declared", "declared, n_omax", ("rule", "speed")),
    Quantity("ng-16-targets", "contaminated", "of the template covered, n_omax", ("rule", "speed")),
    Quantity("ng-17", "in_view", "target in view at the end, candidates", ("candidates",)),
    Quantity("ng-17", "overlap", "overlap at the end, candidates", ("candidates",)),
    Quantity("ng-19", "centre_error", "centre error [px]", ("coverage", "norm")),
    Quantity("ng-21", "change", "change in deviations, by", ("cause",)),
    Quantity("ng-22", "mean_overlap", "overlap in the end, noise", ("noise",), 3),
    Quantity("ng-22", "false_occlusions", "false occlusions in 100 frames, noise", ("noise",)),
    Quantity("ng-22-lines", "mean_overlap", "overlap on a line through all, noise", ("noise",), 3),
    Quantity("ng-22-lines", "false_occlusions", "false ones on such a line, noise", ("noise",)),
)


def measured_table(tables: Mapping[str, pd.DataFrame]) -> Table:
    """Quantities that stand behind verdicts: means over scenes and frames.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `checks`; what is not there was not measured.
    """
    data = [
        {"claim": quantity.table.upper(), "quantity": words}
        | {
            head: number_words(
                rows.loc[rows["features"] == features, quantity.metric].mean(), quantity.digits
            )
            for features, head in HEADS.items()
        }
        for quantity, words, rows in _rows(tables)
    ]
    return text_table(
        "measured",
        "What was measured on the scenes, as written where nothing else is said: means over "
        "scenes and frames, by features",
        data,
        n_labels=2,
    )


def _rows(tables: Mapping[str, pd.DataFrame]) -> Iterator[tuple[Quantity, str, pd.DataFrame]]:
    """What is measured, in words, and its rows."""
    for quantity in QUANTITIES:
        if quantity.table not in tables:
            continue
        rows = tables[quantity.table]
        if "trace" in rows:
            rows = rows[rows["trace"] == "revised"]
        if not quantity.by:
            yield quantity, quantity.words, rows
            continue
        for values, part in rows.groupby(list(quantity.by), sort=False):
            named = dict(zip(quantity.by, values, strict=True)).items()
            told = ", ".join(WORDS.get((column, v)) or _words(v) for column, v in named)
            yield quantity, f"{quantity.words} {told}", part


def _words(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
