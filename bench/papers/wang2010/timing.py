"""What an update costs: by method, by the number of particles, and for the motion map alone.

All are CPU times [s], of methods as written, measured in one process, in turns on the same images,
for the plain methods and for the compiled trackers. A pass through the images gives one time of
each, the median over frames; it is disturbed where it took noticeably more wall time than CPU time,
as a timing run is, and then left out. Times are kept beside the report until what is timed changes.
"""

import hashlib
import json
import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from math import exp, nan
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import numpy as np
import pandas as pd

import datasets
import trackers
from bench.experiments.contestant import contestant
from bench.metrics.times import DISTURBED_RATIO
from bench.papers.context import Context
from bench.papers.timing import Update, beginning, frame_times, in_turns, slope
from bench.papers.wang2010.plain import (
    PlainCamShift,
    PlainImprovedCamShift,
    PlainParticleFilter,
    PlainWang2010,
)
from bench.papers.wang2010.plain_maps import joint_map, local_difference, moving
from bench.statistics.intervals import mean_interval
from bench.store.files import write_atomically
from datasets.source_digest import source_digest
from trackers.base.interface import Box, Image
from trackers.maps.differences import first_frame, frame_after

__all__ = ["METHODS", "PUBLISHED", "tables", "time_rows"]

PACKAGE = Path(str(trackers.__file__)).parent

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

PASSES, FRAMES = 10, 60
QUICK_PASSES, QUICK_FRAMES = 2, 8


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """Times that claims, tables and figures read; passes that other load disturbed are left out.

    `method_times`, a pass and window of both CamShifts a row: `sequence`, `implementation`
    (`plain`, `compiled`), `window`, and seconds a frame of every method of `METHODS` and of
    `motion` (the motion map alone), all measured side by side; the filters' are the same beside
    both windows. `motion_share`: `implementation`, `window`, `share` of the motion map in what
    improved CamShift takes longer on `hand`. `particle_times`, a pass and number a row: `method`,
    `implementation`, `particles`, `seconds`. `time_slopes`, a line through these a row: `method`,
    `implementation`, and what `bench.papers.timing.slope` tells, a particle. `times`: see
    `beside_published`.
    """
    passes, frames = (QUICK_PASSES, QUICK_FRAMES) if context.effort.quick else (PASSES, FRAMES)
    fewer = max(passes // 2, 1)  # each is of many numbers
    folder = context.folder / "times"
    by_method = _kept(folder, method_times, tuple(PUBLISHED), passes, frames)
    by_number = _kept(folder, particle_times, (TABLE_1,), fewer, frames)
    name = context.description.experiment("table-1")
    runs = frame_times(context.results / name, context.asked.get(name, {}))
    return {
        "method_times": by_method,
        "motion_share": _motion_share(by_method),
        "particle_times": by_number,
        "time_slopes": particle_slopes(by_number),
        "times": beside_published(by_method, runs),
    }


def _kept(
    folder: Path,
    measure: Callable[[Sequence[str], int, int], pd.DataFrame],
    names: Sequence[str],
    passes: int,
    frames: int,
) -> pd.DataFrame:
    """What was measured undisturbed, now or before on this machine.

    What other load disturbed too often is measured anew the next time.
    """
    source = source_digest(Path(__file__), PACKAGE)
    shown = [[name, datasets.load(name).fingerprint] for name in names]
    machine = [platform.platform(), platform.node()]
    identity = [measure.__name__, shown, source, *machine, passes, frames]
    file = folder / f"{hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]}.json"
    if file.is_file():
        return pd.DataFrame(json.loads(file.read_bytes()))
    times = measure(names, passes, frames)
    quiet = times[times["disturbed"] == 0].drop(columns="disturbed")
    ways = [column for column in ("sequence", "window", "method", "particles") if column in times]
    ways.append("implementation")
    everything = times.groupby(ways).ngroups
    counts = quiet.groupby(ways).size()
    if len(counts) == everything and counts.min() >= passes:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(quiet.to_dict("list")).encode())
    return quiet


def make(method: str, implementation: str, **parameters: Any) -> Any:
    """One of the methods as written, with the same random numbers in both implementations."""
    name, plain = METHODS[method]
    seed = np.random.SeedSequence(0)
    if implementation == "plain":
        return plain(seed, **parameters)
    return trackers.create(name, seed, preset="as-written", **parameters)


def method_times(names: Sequence[str], passes: int, frames: int) -> pd.DataFrame:
    """All methods on sequences; see `tables`, with `disturbed` (0 or 1).

    So many passes are undisturbed; twice as many are made at most, disturbed or not.
    """
    rows = []
    for name, implementation in product(names, IMPLEMENTATIONS):
        images, box = beginning(name, frames)
        updates = partial(_updates, images[0], box, implementation)
        for seconds, disturbed in _passes(updates, images[1:], passes):
            for window in WINDOWS:
                times = {
                    method: seconds[f"{method} {window}" if method in WINDOWED else method]
                    for method in (*METHODS, "motion")
                }
                where = {"sequence": name, "implementation": implementation, "window": window}
                rows.append({**where, "disturbed": disturbed, **times})
    return pd.DataFrame(rows)


def particle_times(names: Sequence[str], passes: int, frames: int) -> pd.DataFrame:
    """Both filters with several numbers of particles; see `tables` and `method_times`."""
    (name,) = names
    images, box = beginning(name, frames)
    settings = list(product(RADII, NUMBERS))

    def updates(implementation: str) -> dict[str, Update]:
        found = {}
        for method, number in settings:
            one = make(method, implementation, particles=number, radius=RADII[method])
            one.init(images[0], box)
            found[f"{method} {number}"] = one.update
        return found

    return pd.DataFrame(
        {
            "method": method,
            "implementation": implementation,
            "particles": number,
            "disturbed": disturbed,
            "seconds": medians[f"{method} {number}"],
        }
        for implementation in IMPLEMENTATIONS
        for medians, disturbed in _passes(partial(updates, implementation), images[1:], passes)
        for method, number in settings
    )


def _passes(
    updates: Callable[[], Mapping[str, Update]], images: Sequence[Image], wanted: int
) -> Iterator[tuple["pd.Series[float]", float]]:
    """Median times of a pass, and 1 for a disturbed one, until there are enough that are not."""
    undisturbed = 0
    for _ in range(2 * wanted):
        chosen = updates()
        cpu, wall = thread_time(), perf_counter()
        times = in_turns(chosen, images)
        wall, cpu = perf_counter() - wall, thread_time() - cpu
        disturbed = wall > DISTURBED_RATIO * cpu
        yield times.median(), float(disturbed)
        undisturbed += not disturbed
        if undisturbed == wanted:
            return


def _updates(first: Image, box: Box, implementation: str) -> dict[str, Update]:
    updates = {"motion": _motion(first, implementation)}
    for method in METHODS:
        for window in WINDOWS if method in WINDOWED else ("",):
            one = make(method, implementation, **({"window": window} if window else {}))
            one.init(first, box)
            updates[f"{method} {window}".rstrip()] = one.update
    return updates


def _motion(first: Image, implementation: str) -> Update:
    """What makes the motion map of the next image; in plain code, joins it to a map of colours."""
    if implementation == "compiled":
        motion = first_frame(first)

        def compiled(image: Image) -> None:
            nonlocal motion
            motion = frame_after(image, motion, 5, True)

        return compiled

    previous, before = first, local_difference(first, first)
    colour = np.ones(first.shape[:2])

    def plain(image: Image) -> None:
        nonlocal previous, before
        latest = local_difference(image, previous)
        joint_map(colour, moving((latest + before) / 2))
        previous, before = image, latest

    return plain


def particle_slopes(times: pd.DataFrame) -> pd.DataFrame:
    """What one particle more costs; see `tables`."""
    keys = ["method", "implementation"]
    lines = [
        dict(zip(keys, values, strict=True)) | slope(rows["particles"], rows["seconds"])
        for values, rows in times.groupby(keys, sort=False)
    ]
    return pd.DataFrame(lines, columns=[*keys, "slope", "lower_limit", "upper_limit", "r_squared"])


def _motion_share(times: pd.DataFrame) -> pd.DataFrame:
    here = times[times["sequence"] == SECTION_3_2].groupby(["implementation", "window"])
    medians = here[["camshift", "camshift_improved", "motion"]].median()
    longer = medians["camshift_improved"] - medians["camshift"]
    return (medians["motion"] / longer).rename("share").reset_index()


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
        `runs`), `passes`, `paper` [s], `seconds` (median); `paper_ratio` and `ratio` (geometric
        mean over passes) over CamShift with a fixed window, and in a row of their own those of the
        particle filter over the proposed one.
    """
    rows: list[dict[str, Any]] = []
    for sequence, published in PUBLISHED.items():
        here = times[times["sequence"] == sequence]
        for method in published:
            for window in WINDOWS if method in WINDOWED else ("",):
                known: dict[str, Any] = {"sequence": sequence, "method": method, "window": window}
                known |= {"paper": published[method]}
                known |= {"paper_ratio": published[method] / published["camshift"]}
                for name in IMPLEMENTATIONS:
                    both = here[here["implementation"] == name]
                    fixed = both.loc[both["window"] == "fixed", "camshift"]
                    own = both.loc[both["window"] == (window or "fixed"), method]
                    found = {"seconds": own.median(), "ratio": _ratio(own, fixed)}
                    rows.append({**known, "timed": name, "passes": len(own), **found})
                seconds = nan if window == "adaptive" else _of_runs(runs, sequence, method)
                rows.append({**known, "timed": "runs", "seconds": seconds})
    first = times[(times["sequence"] == TABLE_1) & (times["window"] == "fixed")]
    paper = PUBLISHED[TABLE_1]
    known = {"sequence": TABLE_1, "method": "particle filter over proposed", "window": ""}
    known |= {"paper_ratio": paper["particle_filter"] / paper["proposed"]}
    for name in IMPLEMENTATIONS:
        both = first[first["implementation"] == name]
        ratio = _ratio(both["particle_filter"], both["proposed"])
        rows.append({**known, "timed": name, "passes": len(both), "ratio": ratio})
    return pd.DataFrame(rows)


def _ratio(longer: "pd.Series[float]", shorter: "pd.Series[float]") -> float:
    """Geometric mean over passes; NaN where there is none."""
    logs = np.log(longer.to_numpy() / shorter.to_numpy())
    return exp(logs.mean()) if len(logs) else nan


def _of_runs(runs: pd.DataFrame, sequence: str, method: str) -> float:
    """Seconds a frame: median over frames of medians over repetitions."""
    label = contestant(f"{METHODS[method][0]}:preset=as-written").label
    here = runs[(runs["tracker"] == label) & (runs["sequence"] == sequence)]
    return float(here.groupby("frame")["seconds"].median().median())


def time_rows(times: pd.DataFrame) -> list[dict[str, Any]]:
    """Table 1 and the times of section 3.2: seconds a frame, and ratios to CamShift's.

    Parameters
    ----------
    times : DataFrame
        `method_times` of `tables`; ours are those in plain NumPy, CamShift's window fixed.

    Returns
    -------
    list of dict
        See `bench.papers.Report.rows`. Seconds have quartiles over passes, ratios a 95 %
        interval, which one pass alone has not; there is no row of what was never measured
        undisturbed.
    """
    plain = times[(times["implementation"] == "plain") & (times["window"] == "fixed")]
    rows = []
    for sequence, seconds in PUBLISHED.items():
        here = plain[plain["sequence"] == sequence]
        table = "table-1" if sequence == TABLE_1 else "section-3.2"
        for method, published in seconds.items() if len(here) else ():
            label = {"table": table, "label": method}
            low, middle, high = (float(here[method].quantile(q)) for q in (0.25, 0.5, 0.75))
            told = {"column": "seconds a frame", "published": published}
            rows.append({**label, **told, "measured": middle, "interval": [low, high]})
            if method != "camshift":
                logs = np.log(here[method] / here["camshift"])
                limits = [exp(limit) for limit in mean_interval(logs)] if len(logs) > 1 else None
                told = {"column": "ratio to CamShift", "published": published / seconds["camshift"]}
                rows.append({**label, **told, "measured": exp(logs.mean()), "interval": limits})
    return rows
