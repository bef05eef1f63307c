"""The methods that the paper's figures compare, by what figures call them."""

from collections.abc import Mapping

from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS

__all__ = ["EXPERIMENTS", "PRESETS", "compared", "every_method"]

EXPERIMENTS = {
    TABLE_TENNIS: "wang2010-figure-3",
    HAND: "wang2010-figure-5",
    CUP: "wang2010-figure-6",
}
"""Which has the runs of a sequence's figures."""

PRESETS = {"as written": "preset=as-written", "recommended": "preset=recommended"}
"""Of the filters; as they are written in a tracker's text form."""

_CAMSHIFT = {
    "CamShift, fixed window": "camshift",
    "CamShift, adaptive window": "camshift:window=adaptive",
}


def compared(sequence: str, preset: str) -> Mapping[str, str]:
    """Text forms of the methods that the paper compares on a sequence, by label.

    Parameters
    ----------
    sequence : str
        One of `EXPERIMENTS`.
    preset : str
        One of `PRESETS`; it makes no difference to any CamShift.
    """
    chosen = PRESETS[preset]
    if sequence == TABLE_TENNIS:
        return {
            "proposed, N = 60": f"wang2010:{chosen}",
            "particle filter, N = 400": f"particle-filter:{chosen}",
            **_CAMSHIFT,
        }
    if sequence == HAND:
        return {"improved CamShift": "camshift-improved:preset=as-written", **_CAMSHIFT}
    return {
        "proposed, N = 15": f"wang2010:{chosen}:particles=15",
        "by hue alone, N = 15": f"wang2010:{chosen}:particles=15:alpha=1:beta=0",
    }


def every_method(sequence: str, preset: str) -> Mapping[str, str]:
    """The same, and below them the other methods of the paper."""
    known = compared(sequence, preset)
    chosen = PRESETS[preset]
    others = {
        "proposed, N = 60": f"wang2010:{chosen}",
        "particle filter, N = 400": f"particle-filter:{chosen}",
        **_CAMSHIFT,
        "improved CamShift": "camshift-improved:preset=as-written",
    }
    if sequence == CUP:  # with its own number
        del others["proposed, N = 60"]
    return {**known, **others}
