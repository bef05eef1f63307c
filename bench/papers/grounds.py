"""What the verdict on a claim rests on: numbers of its scenes, and the runs that made them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Any

import pandas as pd

from bench.claims.judging import headline_sides
from bench.claims.kinds import (
    COUNTS,
    ERRORS,
    IN_PIXELS,
    SCORES,
    BoundTest,
    CheckTest,
    Comparison,
    PartTest,
    RatioTest,
)
from bench.claims.ledger import Claim
from bench.claims.readings import in_words
from bench.evaluation.record import Trace

__all__ = ["SHOWN", "Ground", "Number", "all_grounds"]

SHOWN = 8
"""Scenes of a test that are shown."""

_MOST_COLUMNS = 8

_ORDERED = "those that speak most against the claim first"

_DECIDING = ("frames_inside", "first_loss")
"""Of the counts, those that decide."""


@dataclass(frozen=True)
class Number:
    """Of a scene: a mean over runs, and the file of the worst one; empty where there is none.

    `trace`: which of its boxes the number is of.
    """

    value: float
    run: str = ""
    trace: Trace = "online"


@dataclass(frozen=True)
class Ground:
    """Scenes that a test rests on.

    `rows`: a scene and its numbers, which stand below the `heads`. `of`: how many scenes there are,
    of which these come first as `order` says. `kind`: what makes a frame the worst one, as
    `bench.pages.takes.Reading.place` knows it. `copied`: trackers whose runs are others', which do
    the same.
    """

    part: str
    heads: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Number]]]
    of: int
    order: str = _ORDERED
    kind: str = "overlap"
    copied: Sequence[str] = ()


@dataclass(frozen=True)
class _Column:
    head: str
    numbers: Mapping[str, Number]  # by scene
    copied: str = ""


def all_grounds(
    claims: Mapping[str, Claim],
    scores: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    together: Callable[[str], str] = str,
) -> dict[str, list[Ground]]:
    """Scenes behind claims under their headline readings, a ground a test that has scenes.

    `scores`, `tables`: as `bench.papers.context.Context` has them. `together`: what tables count a
    sequence under, where that is a set of several.
    """
    ranked = scores.sort_values("mean_overlap", na_position="first", kind="stable")
    ranked = ranked.assign(counted_as=ranked["sequence"].map(together))
    return {name: _grounds(claim, scores, tables, ranked) for name, claim in claims.items()}


def _grounds(
    claim: Claim, scores: pd.DataFrame, tables: Mapping[str, pd.DataFrame], ranked: pd.DataFrame
) -> list[Ground]:
    """`ranked`: the scores, failed runs and those of least overlap first."""
    names = "|".join(f",{name}," for name in claim.experiment)
    its = ranked[ranked["experiments"].str.contains(names, regex=True)]
    if isinstance(claim.test, CheckTest):
        return [_runs(its)] if len(its) else []
    found = [
        _of_test(claim, name, test, sides, ranked if test.table == SCORES else its)
        for name, test, sides in headline_sides(claim, scores, tables)
        if {"sequence", "scene"} <= set(sides[0])
    ]
    return [one for one in found if one.rows]


def _runs(its: pd.DataFrame) -> Ground:
    """Runs that a check of the paper's own looked at, whose numbers it alone knows."""
    means = its.groupby(["name", "text"])["mean_overlap"].mean().sort_values()
    worst = its.drop_duplicates(["name", "text"]).set_index(["name", "text"])
    runs: dict[Any, Any] = worst[["path", "trace"]].to_dict("index")
    rows = [
        (f"{name}, {text}", [Number(value, runs[name, text]["path"], runs[name, text]["trace"])])
        for name, text, value in zip(
            means.index.get_level_values(0), means.index.get_level_values(1), means, strict=True
        )
    ][:SHOWN]
    order = "a check of the paper's own judges all of them; those of least overlap first"
    return Ground("", ["mean overlap"], rows, len(means), order)


def _of_test(
    claim: Claim, part: str, test: PartTest, sides: Sequence[pd.DataFrame], ranked: pd.DataFrame
) -> Ground:
    metrics = _metrics(test)
    columns = [
        (place, metric, column)
        for metric in metrics
        for place, rows in enumerate(sides)
        for column in _columns(claim, test, place, rows, metric, ranked)
    ]
    first = [(place, column) for place, metric, column in columns if metric == metrics[0]]
    less = metrics[0].startswith(ERRORS)
    compared = isinstance(test, Comparison)
    against: dict[str, float] = {}
    for scene in dict.fromkeys(scene for _, column in first for scene in column.numbers):
        means = [
            _mean([c.numbers[scene].value for p, c in first if p == side and scene in c.numbers])
            for side in range(len(sides) if compared else 1)
        ]
        ahead = (means[0] - means[1] if compared else means[0]) * (-1 if less else 1)
        against[scene] = ahead
    order = {scene: _badness(test, value) for scene, value in against.items()}
    shown = sorted(order, key=lambda scene: (order[scene], scene))[:SHOWN]
    kept = [column for _, _, column in columns][:_MOST_COLUMNS]
    words = _words(claim, metrics[0])
    heads = [*([f"ahead, {words}"] if compared else []), *(column.head for column in kept)]
    rows = [
        (
            scene,
            [*([Number(against[scene])] if compared else [])]
            + [column.numbers.get(scene, Number(nan)) for column in kept],
        )
        for scene in shown
    ]
    copied = [*dict.fromkeys(column.copied for column in kept if column.copied)]
    return Ground(part, heads, rows, len(order), kind=_kind(metrics[0]), copied=copied)


def _metrics(test: PartTest) -> Sequence[str]:
    if isinstance(test, BoundTest):
        return [test.metric]
    if isinstance(test, RatioTest):
        return [test.longer, test.shorter]
    return [name for name in test.by if name not in COUNTS or name in _DECIDING] or test.by


def _columns(
    claim: Claim,
    test: PartTest,
    place: int,
    rows: pd.DataFrame,
    metric: str,
    ranked: pd.DataFrame,
) -> Iterator[_Column]:
    """A column a tracker of a side; one of what is no runs'."""
    words = _words(claim, metric)
    if test.table == SCORES:
        its = ranked.loc[ranked.index.isin(rows.index)]
        worst = its.drop_duplicates(["text", "name"])
        places = zip(*(worst[key] for key in ("text", "name", "path", "trace")), strict=True)
        mean = its.groupby(["text", "name"])[metric].mean().to_dict()
        columns: dict[str, dict[str, Number]] = {}
        for text, name, *run in places:
            columns.setdefault(text, {})[name] = Number(float(mean[text, name]), *run)
        copied = {*its.loc[its["copied"], "text"]}
        for text, numbers in columns.items():
            yield _Column(f"{text}: {words}", numbers, text if text in copied else "")
        return
    named = {*rows["tracker"].dropna()} if "tracker" in rows else set()
    traces = {*rows["trace"].dropna()} if "trace" in rows else set()
    known = ranked[ranked["tracker"].isin(named)] if named else ranked
    known = known[known["trace"].isin(traces)] if traces else known
    if "text" in rows:
        known = known[known["text"].isin(rows["text"])]
    worst = known.drop_duplicates(["counted_as", "scene"]).set_index(["counted_as", "scene"])
    runs: dict[Any, Any] = worst[["sequence", "name", "path", "trace"]].to_dict("index")
    numbers = {}
    means = rows.groupby(["sequence", "scene"])[metric].mean().reset_index()
    for sequence, scene, value in means.itertuples(index=False, name=None):
        run = runs.get((sequence, scene), {"sequence": "", "path": "", "trace": "online"})
        own = run["name"] if run["sequence"] == sequence else f"{sequence}, scene {scene}"
        numbers[own] = Number(float(value), run["path"], run["trace"])
    side = test.sides[place]
    told = side if isinstance(side, str) else ", ".join(map(_named, side.values()))
    yield _Column(": ".join(filter(None, [told, words])), numbers)


def _named(value: object) -> str:
    """A value that a side's rows have, or the several of which they have one."""
    return " / ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _mean(values: Sequence[float]) -> float:
    known = [value for value in values if isfinite(value)]
    return sum(known) / len(known) if known else nan


def _badness(test: PartTest, ahead: float) -> float:
    """Less for a scene that speaks against a test; not known comes last."""
    if not isfinite(ahead):
        return inf
    return -ahead if test.kind == "lost" else ahead


def _words(claim: Claim, metric: str) -> str:
    """A metric with its unit."""
    name = in_words(metric)
    usual = "px" if metric.startswith(IN_PIXELS) else "frames" if metric in COUNTS else ""
    unit = claim.units.get(metric, usual)
    return f"{name} [{unit}]" if unit else name


def _kind(metric: str) -> str:
    if metric.startswith(ERRORS):
        return "centre_error"
    return "loss" if metric.startswith(("first_loss", "lost", "frames_inside")) else "overlap"
