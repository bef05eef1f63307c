"""What was measured on the scenes, in figures."""

from collections.abc import Mapping
from typing import NamedTuple

import pandas as pd

from bench.papers.moreno2005.tables import SEQUENCES, UNPUBLISHED, preset_words
from bench.papers.tables import number_words, text_table
from reports.tables import Table

__all__ = ["measured_table"]


CONTRASTS = {"all": "all frames", "least": "least contrast"}
"""Of the frames, those that the claim speaks of."""


class Quantity(NamedTuple):
    """A column of a table of `scenes`.

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
    """

    table: str
    metric: str
    words: str
    by: tuple[str, ...]


QUANTITIES = (
    Quantity("mo-9", "region_similarity", "J by a patch of the target's colour", ("patch",)),
    Quantity("mo-11", "region_similarity", "J by contrast", ("contrast", "mask")),
    Quantity("mo-20", "told_apart", "share of pixels told apart", ("space",)),
    Quantity("mo-21", "contour_accuracy", "F of the snake by edges", ("edges",)),
    Quantity("mo-21", "region_similarity", "J of the snake by edges", ("edges",)),
)


def measured_table(tables: Mapping[str, pd.DataFrame]) -> Table:
    """Quantities that stand behind verdicts: means over scenes and frames, by sequence.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        See `scenes`, and `mo-9` of `scores.similar_patches`; what is not there was not measured.
    """
    data = []
    for quantity in QUANTITIES:
        rows = tables.get(quantity.table)
        if rows is None or rows.empty:
            continue
        if "contrast" in rows:
            rows = rows.assign(contrast=rows["contrast"].map(CONTRASTS)).dropna(subset="contrast")
        if "preset" in rows:
            rows = rows.assign(preset=rows["preset"].map(preset_words))
        keys = [*(("preset",) if "preset" in rows else ()), *quantity.by]
        for values, part in rows.groupby(keys, sort="preset" in rows):
            means = part.groupby("sequence")[quantity.metric].mean()
            data.append(
                {
                    "claim": quantity.table.upper(),
                    "quantity": f"{quantity.words}: {', '.join(map(str, values))}",
                    **{
                        words: number_words(float(means.get(name, float("nan"))), 3)
                        for name, words in SEQUENCES.items()
                    },
                }
            )
    return text_table(
        "measured",
        "What was measured on the scenes, means over scenes and frames. "
        + UNPUBLISHED.capitalize(),
        data,
        n_labels=2,
    )
