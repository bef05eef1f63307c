"""Deviations of the dynamics that were learnt from a segmented sequence, and those set by hand.

`as-written` has the former, `recommended` the latter; here each preset has the other's (MO-23).
"""

import pandas as pd

__all__ = ["OTHERS", "PROPOSED", "by_deviations", "is_deviation"]

PRESETS = ("as-written", "recommended")
PROPOSED, OTHERS = "proposed", "other deviations"
"""What the method is called with a preset's own, and with those of the other."""


def is_deviation(parameter: str) -> bool:
    """Whether a parameter of the tracker says how far its dynamics stray."""
    return parameter.endswith("_spread") or parameter == "jump_probability"


def by_deviations(scores: pd.DataFrame) -> pd.DataFrame:
    """Rows of the scores that `deviations` (`learnt`, `by hand`) tells apart."""
    pieces = []
    for method, named in ((PROPOSED, ("learnt", "by hand")), (OTHERS, ("by hand", "learnt"))):
        runs = scores[scores["method"] == method]
        said = dict(zip(PRESETS, named, strict=True))
        pieces.append(runs.assign(deviations=runs["preset"].map(said)))
    return pd.concat(pieces, ignore_index=True)
