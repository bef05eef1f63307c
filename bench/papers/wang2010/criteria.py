"""What must hold by an earlier trial on scenes of its own: met or missed; nothing is asserted."""

from collections.abc import Mapping
from math import isfinite
from typing import TypeAlias

import pandas as pd

from bench.claims.ledger import ANY
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.scores import CAMSHIFT, FILTER, IMPROVED, PROPOSED, RULE
from reports.tables import MISSING, Cell, Table

__all__ = ["criteria_table"]

_HEADS = ["criterion", "setting", "what must hold", "earlier trial", "here", "met"]
_TWENTY = 20  # seeds, of which the earlier trial counted
MILLISECONDS, AGREEMENT, FLAT = 0.5, 1e-9, 0.98

Tables = Mapping[str, pd.DataFrame]
Scenes: TypeAlias = "pd.Series[float]"
"""A value by scene."""

Row = tuple[str, str, str, str, str, str]


def criteria_table(scores: pd.DataFrame, tables: Tables) -> Table:
    """What an earlier trial found, and what is found here.

    Parameters
    ----------
    scores : DataFrame
        See `tidy_scores`; no run failed. Of each scene the first repetition counts, as there.
    tables : mapping of str to DataFrame
        `frame_times` and `method_times` of `timing`, `agreement`.
    """
    first = scores[scores["repetition"] == 0]
    rows = [
        *_speed_up(first, "as-written", ""),
        *_speed_up(first, "as-written", "sigma=0.2"),
        *_windows(first),
        *_hand(first),
        *_cup(first),
        _weights(scores),
        *_speed(tables),
    ]
    return Table(
        name="criteria",
        caption=(
            "Findings of an earlier trial on scenes of its own, 20 seeds, and whether they are met "
            "on these: the first repetition of each scene. σ = 0.2 was chosen after seeing that "
            "trial's results; frames counted from 1"
        ),
        heads=_HEADS,
        n_labels=3,
        rows=[[Cell(text) for text in row] for row in rows],
        data=pd.DataFrame(rows, columns=_HEADS),
    )


def _speed_up(scores: pd.DataFrame, preset: str, variant: str) -> list[Row]:
    """C1 and C2 as written, C3 and C4 with σ = 0.2."""
    ours = _runs(scores, TABLE_TENNIS, PROPOSED, preset, variant)
    theirs = _runs(scores, TABLE_TENNIS, FILTER, preset, variant)
    fixed = _runs(scores, TABLE_TENNIS, CAMSHIFT, window="fixed")
    stretch = "centre_error_12_to_16"
    below = _less(ours[stretch], theirs[stretch])
    words = "error over 12–16 below the particle filter's in"
    if variant:
        deviates, back = theirs["deviates_12_to_15"], theirs["back_at_16"].dropna()
        return [
            _counted(
                "C3", "σ = 0.2", "in tolerance in 12–16 in", ours["tolerated_12_to_16"], 18, "20"
            ),
            _counted("C3", "σ = 0.2", words, below, 17, "20"),
            _counted("C4", "σ = 0.2", "particle filter deviates in 12–15 in", deviates, 5, "10"),
            _shared("C4", "σ = 0.2", "of these back at 16", back, 0.8, "10 of 10"),
        ]
    lost = 1 - ours["tolerated_12_to_16"]
    early = theirs["centre_error_1_to_11"]
    beneath = _less(ours[stretch], fixed[stretch])
    words_fixed = "error over 12–16 below fixed CamShift's in"
    return [
        _counted("C1", "as written", words, below, 18, "20"),
        _counted("C1", "as written", words_fixed, beneath, 14, "17"),
        _counted(
            "C2", "as written", "documented failure: beyond tolerance in 12–16 in", lost, 15, "19"
        ),
        _above(
            "C2",
            "as written",
            "particle filter's mean error over 1–11 above 6 px",
            early.mean(),
            6.0,
            "9.3",
            "px",
        ),
    ]


def _windows(scores: pd.DataFrame) -> list[Row]:
    """C5."""
    fixed, adaptive = (
        _runs(scores, TABLE_TENNIS, CAMSHIFT, window=window)["tolerated_at_16"]
        for window in ("fixed", "adaptive")
    )
    return [
        _counted("C5", "fixed window", "CamShift beyond tolerance at 16 in", 1 - fixed, 14, "17"),
        _counted("C5", "adaptive window", "CamShift in tolerance at 16 in", adaptive, 18, "20"),
    ]


def _hand(scores: pd.DataFrame) -> list[Row]:
    """C6."""
    improved = _runs(scores, HAND, IMPROVED, "as-written", window="fixed")["success"]
    fixed = _runs(scores, HAND, CAMSHIFT, window="fixed")
    words = "CamShift at frame 100 is more than 40 px off (median)"
    return [
        _counted("C6", "fixed window", "improved CamShift succeeds in", improved, 12, "15"),
        _counted("C6", "fixed window", "CamShift fails in", 1 - fixed["success"], 19, "20"),
        _above("C6", "fixed window", words, fixed["error_at_100"].median(), 40.0, "71", "px"),
    ]


def _cup(scores: pd.DataFrame) -> list[Row]:
    """C7."""
    ours, hue = (
        _runs(scores, CUP, PROPOSED, "as-written", model=model)["success"]
        for model in ("fused", "hue")
    )
    return [
        _counted("C7", "as written, N = 15", "proposed succeeds in", ours, 18, "20"),
        _counted("C7", "as written, N = 15", "hue alone fails in", 1 - hue, 18, "20"),
    ]


def _weights(scores: pd.DataFrame) -> Row:
    """C8: of every filter and sequence the lowest mean over frames and runs."""
    usual = scores["tracker"].isin([PROPOSED, FILTER]) & (scores["budget"] == "paper")
    usual &= (scores["preset"] == "as-written") & (scores["variant"] == "")
    runs = scores[usual & (scores["model"] == "fused") & scores["radius"].isin([RULE, ANY])]
    means = runs.groupby(["tracker", "sequence"])["effective_sample_size"].mean()
    words = "effective sample size over N at least 0.98, of both filters on every sequence"
    least = means.min()
    return _row("C8", "as written", words, "0.997", f"{least:.3f}", least, least >= FLAT)


def _speed(tables: Tables) -> list[Row]:
    """C9."""
    frames, agreement = tables["frame_times"], tables["agreement"]
    here = frames[(frames["sequence"] == TABLE_TENNIS) & (frames["method"] == "proposed")]
    slow = 1e3 * here["seconds"].median()
    apart = agreement["difference"].max()
    words = "compiled, 142 × 115 pixels: at most 0.5 ms a frame"
    order = "plain: CamShift < proposed < particle filter in time"
    return [
        _row("C9", "N = 60", words, "0.18 ms", f"{slow:.2f} ms", slow, slow <= MILLISECONDS),
        _row(
            "C9",
            "presets, windows, limits",
            "compiled equals plain to 1e-9 px",
            "1e-12 px",
            f"{apart:.1e} px",
            apart,
            apart <= AGREEMENT,
        ),
        _ordered(order, tables["method_times"]),
    ]


def _ordered(words: str, times: pd.DataFrame) -> Row:
    chosen = (times["sequence"] == TABLE_TENNIS) & (times["implementation"] == "plain")
    fixed = times[chosen & (times["window"] == "fixed")]
    medians = [1e3 * fixed[name].median() for name in ("camshift", "proposed", "particle_filter")]
    here = " / ".join(f"{value:.2f}" for value in medians) + " ms"
    earlier = "1.29 / 4.03 / 6.35 ms"
    return _row("C9", "as written", words, earlier, here, medians[0], sorted(medians) == medians)


def _runs(
    scores: pd.DataFrame,
    sequence: str,
    tracker: str,
    preset: str | None = None,
    variant: str = "",
    model: str = "fused",
    window: str | None = None,
) -> pd.DataFrame:
    """One run a scene, by scene, as the paper's number of particles and radius have it."""
    chosen = (scores["sequence"] == sequence) & (scores["tracker"] == tracker)
    if preset is not None:
        chosen &= (scores["preset"] == preset) & (scores["variant"] == variant)
        chosen &= scores["model"] == model
        chosen &= (scores["budget"] != "other") & (scores["reach"] != "3.87")
        chosen &= scores["radius"].isin([RULE, ANY])
    if window is not None:
        chosen &= scores["window"] == window
    return scores[chosen].set_index("scene")


def _less(ours: Scenes, theirs: Scenes) -> Scenes:
    """Scenes in which ours is less, of those that both have."""
    differences = (theirs - ours).dropna()
    return (differences > 0).astype(float)


def _counted(name: str, setting: str, words: str, scenes: Scenes, least: int, earlier: str) -> Row:
    """Something must be so in so many of twenty scenes."""
    told = f"{words} {least} of {_TWENTY}"
    return _shared(name, setting, told, scenes, least / _TWENTY, f"{earlier} of {_TWENTY}")


def _shared(name: str, setting: str, words: str, scenes: Scenes, least: float, earlier: str) -> Row:
    told = words if f"of {_TWENTY}" in words else f"{words} {100 * least:.0f} %"
    count, number = scenes.sum(), len(scenes)
    if not number:
        return name, setting, told, earlier, MISSING, MISSING
    return _row(
        name, setting, told, earlier, f"{count:.0f} of {number}", count, count >= least * number
    )


def _above(
    name: str,
    setting: str,
    words: str,
    value: float,
    least: float,
    earlier: str,
    unit: str,
) -> Row:
    here, earlier = (f"{told} {unit}" for told in (f"{value:.1f}", earlier))
    return _row(name, setting, words, earlier, here, value, value > least)


def _row(
    name: str, setting: str, words: str, earlier: str, here: str, value: float, met: bool
) -> Row:
    """Met or missed; neither where nothing is known."""
    if not isfinite(value):
        return name, setting, words, earlier, MISSING, MISSING
    return name, setting, words, earlier, here, "yes" if met else "no"
