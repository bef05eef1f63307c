"""What an update costs: by method, by the number of particles, and for the motion map alone.

All are CPU times, measured in one process, in turns on the same images, for the plain methods and
for the compiled trackers.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

import trackers
from bench.papers.in_turns import Update, beginning, in_turns, slope
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
from trackers.colour_motion.differences import first_frame, frame_after

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
        How often each is tracked through.
    frames : int
        How many of its frames, from the first.

    Returns
    -------
    DataFrame
        A row a pass, frame and window of both CamShifts: `sequence`, `implementation`, `window`,
        and CPU seconds of every method of `METHODS`, and of `motion`. The filters' are the same
        beside both windows.
    """
    pieces = []
    for name in names:
        images, box = beginning(name, frames)
        for implementation in IMPLEMENTATIONS:
            for _ in range(passes):
                found = _pass(images, box, implementation)
                for window in WINDOWS:
                    columns = {f"{method} {window}": method for method in WINDOWED}
                    of_window = found.rename(columns=columns)[[*METHODS, "motion"]]
                    where = {"sequence": name, "implementation": implementation, "window": window}
                    pieces.append(of_window.assign(**where))
    return pd.concat(pieces, ignore_index=True)


def _pass(images: Sequence[Image], box: Box, implementation: str) -> pd.DataFrame:
    updates = {"motion": _motion(images[0], implementation)}
    for method in METHODS:
        for window in WINDOWS if method in WINDOWED else ("",):
            one = make(method, implementation, **({"window": window} if window else {}))
            one.init(images[0], box)
            updates[f"{method} {window}".rstrip()] = one.update
    return in_turns(updates, images[1:])


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
        A row a pass: `method`, `implementation`, `particles`, `seconds` (median over frames).
    """
    images, box = beginning(name, frames)
    settings = {f"{method} {number}": (method, number) for method in RADII for number in NUMBERS}
    rows = []
    for implementation in IMPLEMENTATIONS:
        for _ in range(passes):
            updates: dict[str, Update] = {}
            for label, (method, number) in settings.items():
                one = make(method, implementation, particles=number, radius=RADII[method])
                one.init(images[0], box)
                updates[label] = one.update
            medians = in_turns(updates, images[1:]).median()
            rows += [
                {
                    "method": method,
                    "implementation": implementation,
                    "particles": number,
                    "seconds": medians[label],
                }
                for label, (method, number) in settings.items()
            ]
    return pd.DataFrame(rows)


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
        `bench.papers.in_turns.slope` `slope`, `lower_limit`, `upper_limit`, `r_squared`.
    """
    groups = times.groupby(["method", "implementation"], sort=False)
    return pd.DataFrame(
        {"method": method, "implementation": implementation}
        | slope(rows["particles"], rows["seconds"])
        for (method, implementation), rows in groups
    )
