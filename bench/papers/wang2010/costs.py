"""What an update costs: by method, by the number of particles, and for the motion map alone.

All are CPU times, measured in one process, in turns on the same images, for the plain methods and
for the compiled trackers. A pass through the images gives one time of each; it is disturbed where
it took noticeably more wall time than CPU time, as a timing run is.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from time import perf_counter, thread_time
from typing import Any

import numpy as np
import pandas as pd

import trackers
from bench.metrics.times import DISTURBED_RATIO
from bench.papers.timing import Update, beginning, in_turns, slope
from bench.papers.wang2010.plain import (
    PlainCamShift,
    PlainImprovedCamShift,
    PlainParticleFilter,
    PlainWang2010,
    joint_map,
    local_difference,
    moving,
)
from trackers.base.interface import Box, Image
from trackers.maps.differences import first_frame, frame_after

__all__ = [
    "IMPLEMENTATIONS",
    "METHODS",
    "WINDOWED",
    "WINDOWS",
    "make",
    "method_times",
    "particle_slopes",
    "particle_times",
]

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
"""By the rule, for each filter's own number of particles."""

WINDOW = 5  # of local differences


def make(method: str, implementation: str, **parameters: Any) -> Any:
    """One of the methods as written, with the same random numbers in both implementations."""
    name, plain = METHODS[method]
    seed = np.random.SeedSequence(0)
    if implementation == "plain":
        return plain(seed, **parameters)
    return trackers.create(name, seed, preset="as-written", **parameters)


def method_times(names: Sequence[str], passes: int, frames: int) -> pd.DataFrame:
    """All methods as written and the motion map alone, side by side.

    Parameters
    ----------
    names : sequence of str
        Sequences.
    passes : int
        How often each is tracked through undisturbed; twice as often at most, disturbed or not.
    frames : int
        How many of its frames, from the first.

    Returns
    -------
    DataFrame
        A row a pass and window of both CamShifts: `sequence`, `implementation`, `window`,
        `disturbed` (0 or 1), and CPU seconds a frame, medians over the pass, of every method of
        `METHODS`, and of `motion`. The filters' are the same beside both windows.
    """
    rows = []
    for name in names:
        images, box = beginning(name, frames)
        for implementation in IMPLEMENTATIONS:
            updates = partial(_updates, images[0], box, implementation)
            for seconds, disturbed in _passes(updates, images[1:], passes):
                where = {"sequence": name, "implementation": implementation}
                for window in WINDOWS:
                    times = {
                        method: seconds[f"{method} {window}" if method in WINDOWED else method]
                        for method in (*METHODS, "motion")
                    }
                    rows.append({**where, "window": window, "disturbed": disturbed, **times})
    return pd.DataFrame(rows)


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
            motion = frame_after(image, motion, WINDOW, True)

        return compiled

    previous, before = first, local_difference(first, first, WINDOW)
    colour = np.ones(first.shape[:2])

    def plain(image: Image) -> None:
        nonlocal previous, before
        latest = local_difference(image, previous, WINDOW)
        joint_map(colour, moving((latest + before) / 2))
        previous, before = image, latest

    return plain


def particle_times(name: str, passes: int, frames: int) -> pd.DataFrame:
    """Both filters with several numbers of particles.

    Their transition keeps the radius of `RADII`: by the rule the cloud would grow with the number,
    and with it what the compiled trackers sum up.

    Parameters as `method_times`, for one sequence.

    Returns
    -------
    DataFrame
        A row a pass and number: `method`, `implementation`, `particles`, `disturbed` (0 or 1),
        `seconds` (median over frames).
    """
    images, box = beginning(name, frames)
    settings = {f"{method} {number}": (method, number) for method in RADII for number in NUMBERS}

    def updates(implementation: str) -> dict[str, Update]:
        found = {}
        for label, (method, number) in settings.items():
            one = make(method, implementation, particles=number, radius=RADII[method])
            one.init(images[0], box)
            found[label] = one.update
        return found

    return pd.DataFrame(
        {
            "method": method,
            "implementation": implementation,
            "particles": number,
            "disturbed": disturbed,
            "seconds": medians[label],
        }
        for implementation in IMPLEMENTATIONS
        for medians, disturbed in _passes(partial(updates, implementation), images[1:], passes)
        for label, (method, number) in settings.items()
    )


def particle_slopes(times: pd.DataFrame) -> pd.DataFrame:
    """What one particle more costs.

    Parameters
    ----------
    times : DataFrame
        See `particle_times`.

    Returns
    -------
    DataFrame
        A row a method and implementation: `method`, `implementation`, and of
        `bench.papers.timing.slope` `slope`, `lower_limit`, `upper_limit`, `r_squared`.
    """
    groups = times.groupby(["method", "implementation"], sort=False)
    lines = [
        {"method": method, "implementation": implementation}
        | slope(rows["particles"], rows["seconds"])
        for (method, implementation), rows in groups
    ]
    columns = ["method", "implementation", "slope", "lower_limit", "upper_limit", "r_squared"]
    return pd.DataFrame(lines, columns=columns)
