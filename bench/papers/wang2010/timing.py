"""What an update costs: by method, by the number of particles, and for the motion map alone.

All are CPU times [s] of methods as written that take turns on the same images in memory, the plain
methods and the compiled trackers each among themselves; see `bench.papers.timing`.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import product
from math import nan
from typing import Any

import numpy as np
import pandas as pd

import trackers
from bench.experiments.contestant import contestant
from bench.papers.context import Context
from bench.papers.timing import (
    beginning,
    frame_times,
    geometric_mean,
    kept_times,
    slope,
    turn_times,
)
from bench.papers.wang2010.plain import (
    PlainCamShift,
    PlainImprovedCamShift,
    PlainParticleFilter,
    PlainWang2010,
)
from bench.papers.wang2010.plain_maps import joint_map, local_difference, moving
from bench.statistics.intervals import mean_interval
from trackers.base.interface import Box, Image
from trackers.maps.differences import first_frame, frame_after

__all__ = ["METHODS", "PUBLISHED", "tables", "time_rows"]

TABLE_1, SECTION_3_2 = "wang2010/table-tennis:version=2", "wang2010/hand"
PUBLISHED: Mapping[str, Mapping[str, float]] = {
    TABLE_1: {"camshift": 0.063, "proposed": 0.120, "particle_filter": 0.214},
    SECTION_3_2: {"camshift": 0.071, "camshift_improved": 0.098},
}
"""Seconds a frame of Table 1 and of section 3.2, by sequence and method."""

IMPLEMENTATIONS = ("plain", "compiled")
METHODS: Mapping[str, tuple[str, type[Any]]] = {
    "camshift": ("camshift", PlainCamShift),
    "camshift_improved": ("camshift-improved", PlainImprovedCamShift),
    "proposed": ("wang2010", PlainWang2010),
    "particle_filter": ("particle-filter", PlainParticleFilter),
}
"""The tracker's name and the plain method, by the name of a column."""

WINDOWED = ("camshift", "camshift_improved")
WINDOWS = ("fixed", "adaptive")

NUMBERS = (15, 60, 100, 200, 400, 800)
"""Of particles."""

RADII = {"proposed": 60**0.5 / 2, "particle_filter": 400**0.5 / 2}
"""Of the transition [pixels], by the rule for each filter's own number of particles, whatever it is
here: else the cloud would grow with the number, and with it what the compiled trackers sum up."""


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """Times that claims, tables and figures read.

    `method_times`, a round and window of both CamShifts a row: `sequence`, `implementation`
    (`plain`, `compiled`), `window`, seconds a frame of every method of `METHODS` and of `motion`
    (the motion map alone), which all took turns, and of the `reference`; the filters' are the same
    beside both windows. `motion_share`: `implementation`, `window`, `share` of the motion map in
    what improved CamShift takes longer on `hand`, with the 95 % limits `low` and `high`.
    `particle_times`, a round and number a row: `method`, `implementation`, `particles`, `seconds`.
    `time_slopes`, a line through these a row: `method`, `implementation`, and what
    `bench.papers.timing.slope` tells, a particle. `times`: see `beside_published`.
    """
    name = context.description.experiment("table-1")
    if name not in context.asked:  # a quick look times nothing
        return {}
    by_method = kept_times(context, method_times, tuple(PUBLISHED), frames=20)
    by_number = kept_times(context, particle_times, (TABLE_1,), frames=8)
    runs = frame_times(context.results / name, context.asked[name])
    return {
        "method_times": by_method,
        "motion_share": motion_share(by_method),
        "particle_times": by_number,
        "time_slopes": particle_slopes(by_number),
        "times": beside_published(by_method, runs[runs["disturbed"] == 0]),
    }


def make(method: str, implementation: str, **parameters: Any) -> Any:
    """One of the methods as written, with the same random numbers in both implementations."""
    name, plain = METHODS[method]
    seed = np.random.SeedSequence(0)
    if implementation == "plain":
        return plain(seed, **parameters)
    return trackers.create(name, seed, preset="as-written", **parameters)


def method_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """All methods on sequences; see `tables`."""
    clips = {name: beginning(name, frames) for name in names}
    columns = ["sequence", "round", *METHODS, "motion", "reference"]
    pieces = []
    for implementation in IMPLEMENTATIONS:
        times = turn_times(_methods(implementation), clips)
        for window in WINDOWS:
            rows = times.rename(columns={f"{method} {window}": method for method in WINDOWED})
            known = {"implementation": implementation, "window": window}
            pieces.append(rows[columns].assign(**known))
    return pd.concat(pieces, ignore_index=True)


def particle_times(names: Sequence[str], frames: int) -> pd.DataFrame:
    """Both filters with several numbers of particles; see `tables`."""
    clips, pieces = {name: beginning(name, frames) for name in names}, []
    for implementation in IMPLEMENTATIONS:
        methods = {
            (method, number): partial(
                make, method, implementation, particles=number, radius=RADII[method]
            )
            for method, number in product(RADII, NUMBERS)
        }
        times = turn_times({f"{method} {n}": one for (method, n), one in methods.items()}, clips)
        for method, number in methods:
            known = {"method": method, "implementation": implementation, "particles": number}
            rows = times[["reference"]].assign(seconds=times[f"{method} {number}"], **known)
            pieces.append(rows)
    return pd.concat(pieces, ignore_index=True)


def _methods(implementation: str) -> dict[str, Callable[[], Any]]:
    methods: dict[str, Callable[[], Any]] = {"motion": partial(_Motion, implementation)}
    for method in METHODS:
        for window in WINDOWS if method in WINDOWED else ("",):
            options = {"window": window} if window else {}
            methods[f"{method} {window}".rstrip()] = partial(
                make, method, implementation, **options
            )
    return methods


class _Motion:
    """What makes the motion map of the next image; in plain code, joins it to a map of colours."""

    def __init__(self, implementation: str) -> None:
        self._compiled = implementation == "compiled"

    def init(self, image: Image, _: Box) -> None:
        """Begin with the first image."""
        self._motion: Any = first_frame(image)
        self._image, self._difference = image, local_difference(image, image)
        self._colour = np.ones(image.shape[:2])

    def update(self, image: Image) -> None:
        """Make a map."""
        if self._compiled:
            self._motion = frame_after(image, self._motion, 5, True)
            return
        latest = local_difference(image, self._image)
        joint_map(self._colour, moving((latest + self._difference) / 2))
        self._image, self._difference = image, latest


def particle_slopes(times: pd.DataFrame) -> pd.DataFrame:
    """What one particle more costs; see `tables`."""
    keys = ["method", "implementation"]
    return pd.DataFrame(
        dict(zip(keys, values, strict=True)) | slope(rows["particles"], rows["seconds"])
        for values, rows in times.groupby(keys, sort=False)
    )


def motion_share(times: pd.DataFrame) -> pd.DataFrame:
    """Of what the improved CamShift takes longer, that of the motion map; see `tables`."""
    rows, keys = [], ["implementation", "window"]
    for values, here in times[times["sequence"] == SECTION_3_2].groupby(keys):
        shares = here["motion"] / (here["camshift_improved"] - here["camshift"])
        low, high = mean_interval(shares)
        known = dict(zip(keys, values, strict=True))
        known |= {"share": shares.mean(), "low": low, "high": high}
        rows.append(known | {"degrees": len(shares) - 1})
    return pd.DataFrame(rows)


def beside_published(times: pd.DataFrame, runs: pd.DataFrame) -> pd.DataFrame:
    """Times beside the paper's, a row a method, a window of a CamShift, and a way to time it.

    Parameters
    ----------
    times : DataFrame
        `method_times` of `tables`.
    runs : DataFrame
        See `bench.papers.timing.frame_times`: timing runs, each compiled and by itself.

    Returns
    -------
    DataFrame
        `sequence`, `method`, `window` (empty for the filters), `timed` (`plain`, `compiled`,
        `as decoded`: timing runs), `paper` [s], `seconds` (median); `paper_ratio` and `ratio`
        (geometric mean over rounds, with the 95 % limits `low` and `high`) over CamShift with a
        fixed window, and in a row of their own those of the particle filter over the proposed one;
        `reference` (median) [s] and `load`, its slowest round over its fastest.
    """
    rows: list[dict[str, Any]] = []
    for sequence, published in PUBLISHED.items():
        for method in published:
            for window in WINDOWS if method in WINDOWED else ("",):
                known: dict[str, Any] = {"sequence": sequence, "method": method, "window": window}
                known |= {"paper": published[method]}
                known |= {"paper_ratio": published[method] / published["camshift"]}
                for name in IMPLEMENTATIONS:
                    own, fixed = (
                        _rounds(times, sequence, name, one) for one in (window or "fixed", "fixed")
                    )
                    found = {"timed": name, "seconds": own[method].median()}
                    found |= _ratio(own, own[method].to_numpy() / fixed["camshift"].to_numpy())
                    rows.append(known | found)
                seconds = nan if window == "adaptive" else _decoded(runs, sequence, method)
                rows.append({**known, "timed": "as decoded", "seconds": seconds})
    paper = PUBLISHED[TABLE_1]
    known = {"sequence": TABLE_1, "method": "particle filter over proposed", "window": ""}
    known |= {"paper_ratio": paper["particle_filter"] / paper["proposed"]}
    for name in IMPLEMENTATIONS:
        both = _rounds(times, TABLE_1, name, "fixed")
        ratios = both["particle_filter"] / both["proposed"]
        rows.append(known | {"timed": name} | _ratio(both, ratios))
    return pd.DataFrame(rows)


def _rounds(times: pd.DataFrame, sequence: str, implementation: str, window: str) -> pd.DataFrame:
    chosen = times["implementation"].eq(implementation) & times["window"].eq(window)
    return times[chosen & times["sequence"].eq(sequence)]


def _ratio(rounds: pd.DataFrame, ratios: Any) -> dict[str, float]:
    machine = rounds["reference"]
    state = {"reference": machine.median(), "load": machine.max() / machine.min()}
    return geometric_mean(ratios) | state


def _decoded(runs: pd.DataFrame, sequence: str, method: str) -> float:
    """Seconds a frame: median over frames of medians over repetitions."""
    label = contestant(f"{METHODS[method][0]}:preset=as-written").label
    here = runs[(runs["tracker"] == label) & (runs["sequence"] == sequence)]
    return float(here.groupby("frame")["decoded"].median().median())


def time_rows(times: pd.DataFrame) -> list[dict[str, Any]]:
    """Table 1 and the times of section 3.2: seconds a frame, and ratios to CamShift's.

    Parameters
    ----------
    times : DataFrame
        `method_times` of `tables`; ours are those in plain NumPy, CamShift's window fixed.

    Returns
    -------
    list of dict
        See `bench.papers.Report.rows`. Seconds have quartiles over rounds, ratios a 95 % interval.
    """
    rows = []
    for sequence, seconds in PUBLISHED.items():
        here = _rounds(times, sequence, "plain", "fixed")
        table = "table-1" if sequence == TABLE_1 else "section-3.2"
        for method, published in seconds.items():
            label = {"table": table, "label": method}
            low, middle, high = (float(here[method].quantile(q)) for q in (0.25, 0.5, 0.75))
            told = {"column": "seconds a frame", "published": published}
            rows.append({**label, **told, "measured": middle, "interval": [low, high]})
            if method != "camshift":
                ratio, *limits = geometric_mean(here[method] / here["camshift"]).values()
                told = {"column": "ratio to CamShift", "published": published / seconds["camshift"]}
                rows.append({**label, **told, "measured": ratio, "interval": limits})
    return rows
