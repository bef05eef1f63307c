"""What claims and tables ask of the runs that `paper.toml` can't say."""

from collections.abc import Iterator, Mapping
from math import nan
from typing import Any

import numpy as np
import pandas as pd

from bench.claims.findings import Check, Evidence, Finding
from bench.claims.measuring import CELL
from bench.papers.context import Context
from bench.papers.nummiaro2003.courses import of_run
from bench.papers.runs import as_run
from bench.statistics.verdicts import check, order
from trackers.histograms.ellipses import EllipseCounts
from trackers.histograms.target_model import TargetModel

__all__ = ["CHECKS", "of_run", "published", "scores", "tables"]

UPDATING = "nummiaro2003:model_update=true:reinitialise=true"
AS_WRITTEN = {"nummiaro2003", "preset=as-written"}
SAME = {
    "model_update=false": [
        f"update_reading={name}" for name in ("printed", "peak", "coefficient", "always")
    ],
    "reinitialise=false": [
        *(f"placement={name}" for name in ("predicted", "borders", "image")),
        *("loss_frames=2", "loss_frames=5"),
    ],
}
"""With the one, a run is the same to the bit with any of the others: without update whatever it
would ask for (but by `variance`, which changes the weights too), without re-initialisation whenever
a target would be lost and wherever it would be looked for."""

ALPHA, UPDATES, BINS = 0.1, 60, 512  # of a model that is updated in every frame

HEAD = "nummiaro2003/head"
HEAD_LENGTH = 450  # frames of the paper's Fig. 10, through all of which the head is followed

_HALF = 0.5  # added to every count of an odds, so that it is finite


def scores(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs, with copies of those that are the same under other readings of the text.

    Only the repetitions that the reading has are copied, so that it is compared with its like.
    Beside what was measured: `tested` (1: a short hiding was; 0), `all_other_frames`, counts as
    shares of the length (`_percent`), and `nearer_with_update` (of runs with update: 1 in scenes in
    which the mean error of Hx is smaller than without).
    """
    options = {text: set(text.split(":")) for text in runs["text"].unique()}
    alone = [text for text, told in options.items() if told - {*SAME} == AS_WRITTEN]
    pieces = [runs]
    for switch, others in SAME.items():
        off = [text for text in alone if switch in options[text]]
        for option in others:
            read = [t for t, told in options.items() if told - {*SAME} == AS_WRITTEN | {option}]
            repetitions = runs.loc[runs["text"].isin(read), "repetition"]
            same = runs[runs["text"].isin(off) & runs["repetition"].isin(repetitions)]
            parameter, _, value = option.partition("=")
            pieces += [as_run(same, **{parameter: value})] if len(same) else []
    every = pd.concat(pieces, ignore_index=True)
    # The knob of `plain/target` is a cloud's share of the light.
    every["light"] = [light if isinstance(light, str) else "even" for light in every["light"]]
    if "noise" not in every:  # a knob of `plain/target`, which is tracked with --all alone
        every["noise"] = nan
    every["tested"] = every["bridged"].notna().astype(float)
    every["all_other_frames"] = every["other_frames"] + every["waiting_frames"]
    for count in ("frames_inside", "success_frames", "first_loss"):
        every[f"{count}_percent"] = 100 * every[count] / every["frames"]
    return every.assign(nearer_with_update=_nearer(every))


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """What stands beside the runs: of scenes, and of the tracker itself.

    `entrances`: runs of `entrance` and `kick_off`, each once. `forgetting`: `difference` by bin of
    the tracker's model after updates from the sum of frames that Equation 12 amounts to.
    """
    made = {"forgetting": _forgetting()}
    waited = [context.tables[name] for name in ("entrance", "kick_off") if name in context.tables]
    if waited:
        keys = ["name", "preset", "kick_off", "repetition"]
        every = pd.concat(waited, ignore_index=True).drop_duplicates(keys)
        made["entrances"] = every.sort_values(["preset", "kick_off"])
    return made


def published(context: Context) -> list[dict[str, Any]]:
    """Fig. 10 for scripts: frames for which the head is followed, the paper's and ours."""
    rows = []
    for preset in ("as-written", "recommended"):
        for words, update in (("with", True), ("without", False)):
            told = {"preset": preset, "model_update": update}
            runs = context.lookup.runs("nummiaro2003", told, [HEAD])
            if runs.empty:
                continue
            row = {"table": "figure-10", "label": f"head, {words} update", "column": preset}
            length, ours = HEAD_LENGTH if update else None, runs["first_loss"]
            measured, interval = None, None
            if (runs["failure"] == "").all():
                measured = float(ours.median())
                interval = [float(ours.quantile(q)) for q in (0.25, 0.75)]
            rows.append({**row, "published": length, "measured": measured, "interval": interval})
    return rows


def update_condition(evidence: Evidence) -> list[Finding]:
    """While tracking, the model is updated in good frames, and hardly ever in others."""
    found = []
    for finding, runs in _updating(evidence):
        names = ("good_frames", "good_updates", "other_frames", "other_updates", "waiting_frames")
        good, good_updates, other, other_updates, waiting = runs[[*names]].sum().tolist()
        if not good or not other:
            continue
        odds = _odds(good_updates, good) / _odds(other_updates, other)
        share = good_updates / good
        reason = (
            f"updates in {100 * share:.1f} % of the good frames and "
            f"{100 * other_updates / other:.1f} % of {other:.0f} others, a ratio of odds of "
            f"{odds:.2f} (while tracking; {100 * other_updates / (other + waiting):.1f} % of the "
            f"others with the {waiting:.0f} in which it initialises)."
        )
        passed = odds > evidence.setting("odds") and share > evidence.setting("least")
        found.append(finding(verdict=check(passed, odds, reason, len(runs))))
    return found


def fast_frames(evidence: Evidence) -> list[Finding]:
    """The centre is inside in fast frames nearly as often as in the others."""
    found = []
    for finding, runs in _updating(evidence):
        known = runs.dropna(subset=["inside_fast", "inside_otherwise"])
        reserve = known["inside_fast"] - evidence.setting("least") * known["inside_otherwise"]
        by_cell = reserve.groupby([known[key] for key in CELL]).mean()
        found.append(finding(verdict=order(by_cell, margin=0.0)))
    return found


def rank_correlation(evidence: Evidence) -> list[Finding]:
    """Two columns of a table rise together."""
    (name,), (first,), (second,) = map(evidence.names, ("table", "first", "second"))
    table = evidence.tables.get(name)
    value = nan if table is None else float(table[first].corr(table[second], method="spearman"))
    if table is None or np.isnan(value):
        return []
    least = evidence.setting("least")
    words = f"rank correlation of {first} and {second} {value:.3f}, to be compared with {least:g}."
    return [Finding(evidence.claim.id, check(value > least, value, words, len(table)))]


CHECKS: Mapping[str, Check] = {
    "update-condition": update_condition,
    "fast-frames": fast_frames,
    "rank-correlation": rank_correlation,
}
"""By the name that the ledger gives."""


def _nearer(runs: pd.DataFrame) -> "pd.Series[float]":
    """Of runs with update: 1 in scenes in which the mean error of Hx is smaller than without."""
    pairs = runs.assign(pair=runs["text"].str.replace(":model_update=false", ""))
    errors = pairs.pivot_table("size_error", ["pair", "name"], "model_update")
    errors = errors.reindex(columns=[False, True]).dropna()
    nearer = (errors[True] < errors[False]).astype(float)
    places = pd.MultiIndex.from_frame(pairs[["pair", "name"]])
    known = pd.Series(nearer.reindex(places).to_numpy(), runs.index)
    return known.where(runs["model_update"].isin([True]))


def _forgetting() -> pd.DataFrame:
    frames = np.random.default_rng(0).dirichlet(np.ones(BINS), UPDATES + 1)
    model = TargetModel(frames[0], 1, False, ALPHA)
    nothing = EllipseCounts(np.zeros((1, 1), int), np.zeros(1, int), np.zeros(1, int))
    for frame in frames[1:]:
        model.update(frame, 1.0, nothing, np.ones(1), 0.0)
    ages = np.arange(UPDATES)[::-1]
    weights = np.r_[(1 - ALPHA) ** UPDATES, ALPHA * (1 - ALPHA) ** ages]
    return pd.DataFrame({"difference": np.abs(model.current - weights @ frames)})


def _updating(evidence: Evidence) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Runs with model update and with re-initialisation, by reading."""
    for finding, (runs,) in evidence.by_reading(evidence.scores, [UPDATING], evidence.names("on")):
        if len(runs):
            yield finding, runs


def _odds(successes: float, trials: float) -> float:
    return (successes + _HALF) / (trials - successes + _HALF)
