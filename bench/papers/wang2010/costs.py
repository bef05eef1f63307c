"""What an update costs: by method, by the number of particles, and for the motion map alone.

All are CPU times, measured in one process, in turns on the same images, for the plain methods and
for the compiled trackers.
"""

from collections.abc import Iterable, Mapping, Sequence
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
from trackers.base.interface import Image
from trackers.colour_motion.differences import first_frame, frame_after

__all__ = ["IMPLEMENTATIONS", "METHODS", "method_times", "motion_times", "particle_slopes",
           "particle_times"]  # fmt: skip

IMPLEMENTATIONS = ("plain", "compiled")
METHODS: Mapping[str, tuple[str, type[Any]]] = {
    "camshift": ("camshift", PlainCamShift),
    "camshift_improved": ("camshift-improved", PlainImprovedCamShift),
    "proposed": ("wang2010", PlainWang2010),
    "particle_filter": ("particle-filter", PlainParticleFilter),
}
"""The tracker's name and the plain method, by the name of a column."""

NUMBERS = (15, 60, 100, 200, 400, 800)
"""Of particles."""

WINDOW = 5  # of local differences


def make(method: str, implementation: str, **parameters: Any) -> Any:
    """One of the methods as written, with the same random numbers in both implementations."""
    name, plain = METHODS[method]
    seed = np.random.SeedSequence(0)
    if implementation == "plain":
        return plain(seed, **parameters)
    return trackers.create(name, seed, preset="as-written", **parameters)


def method_times(names: Sequence[str], passes: int, frames: int) -> pd.DataFrame:
    """All methods as written, side by side.

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
        A row a pass and frame: `sequence`, `implementation`, and CPU seconds of every method of
        `METHODS`.
    """
    pieces = []
    for name in names:
        images, box = beginning(name, frames)
        for implementation in IMPLEMENTATIONS:
            for _ in range(passes):
                updates = {}
                for method in METHODS:
                    tracker = make(method, implementation)
                    tracker.init(images[0], box)
                    updates[method] = tracker.update
                found = in_turns(updates, images[1:])
                pieces.append(found.assign(sequence=name, implementation=implementation))
    return pd.concat(pieces, ignore_index=True)


def particle_times(name: str, passes: int, frames: int) -> pd.DataFrame:
    """Both filters with several numbers of particles.

    Their transition has the radius that the text gives for its own number, whatever the number
    here: with the rule the cloud, and with it what the compiled trackers sum up, would grow, too.

    Parameters as `method_times`, for one sequence.

    Returns
    -------
    DataFrame
        A row a pass: `method`, `implementation`, `particles`, `seconds` (median over frames).
    """
    images, box = beginning(name, frames)
    rows = []
    for implementation in IMPLEMENTATIONS:
        for _ in range(passes):
            updates: dict[str, Update] = {}
            for method, radius in (("proposed", 60**0.5 / 2), ("particle_filter", 10.0)):
                for number in NUMBERS:
                    one = make(method, implementation, particles=number, radius=radius)
                    one.init(images[0], box)
                    updates[f"{method} {number}"] = one.update
            for label, seconds in in_turns(updates, images[1:]).median().items():
                method, number_text = str(label).split()
                rows.append(
                    {
                        "method": method,
                        "implementation": implementation,
                        "particles": int(number_text),
                        "seconds": seconds,
                    }
                )
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


def motion_times(name: str, passes: int, frames: int) -> pd.DataFrame:
    """Traditional and improved CamShift beside the motion map alone.

    Parameters as `method_times`, for one sequence.

    Returns
    -------
    DataFrame
        A row a pass: `implementation`, medians over frames of `camshift`, `camshift_improved`
        and `motion` [seconds], and `share`, that of the motion map in what the improved one
        takes longer.
    """
    images, box = beginning(name, frames)
    rows = []
    for implementation in IMPLEMENTATIONS:
        for _ in range(passes):
            updates = {"motion": _motion(implementation, images)}
            for method in ("camshift", "camshift_improved"):
                one = make(method, implementation)
                one.init(images[0], box)
                updates[method] = one.update
            found = in_turns(updates, images[1:]).median()
            longer = found["camshift_improved"] - found["camshift"]
            share = {"share": found["motion"] / longer}
            rows.append({"implementation": implementation} | found.to_dict() | share)
    return pd.DataFrame(rows)


def _motion(implementation: str, images: Iterable[Image]) -> Update:
    """What makes the motion map of the next image, and adds it to a map of colours."""
    first = next(iter(images))
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
