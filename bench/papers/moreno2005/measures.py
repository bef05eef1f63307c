"""What is measured of the paper's runs beside their scores, and tables that claims read."""

import os
from collections.abc import Mapping
from math import nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.experiments.contestant import contestant
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.moreno2005 import example_tables
from bench.papers.runs import as_run
from bench.papers.timing import frame_times
from datasets.text_form import format_text, parse_text

__all__ = ["SERIES", "deviations", "of_run", "patches", "scores", "tables"]

Values = NDArray[np.float64]

TRACKED = 0.5
"""Region similarity below which a frame is not tracked."""

GONE = 0.1  # below which next to nothing of the target is in the mask

JUMP, PATCH = "light change", "similar patch"
"""Attributes: frames in which the light jumps, or a patch of the target's colour touches it."""

AFTER = 10
"""Which frame from a jump on, itself the first, tells whether a target was lost by it."""

PRESETS = {"as-written": "learnt", "recommended": "by hand"}
"""Where the deviations of a preset's dynamics come from; the experiment `learnt` exchanges them."""


def similarity(course: Course) -> Values:
    """J by frame; NaN where the target is not seen, and in the first frame, which is given."""
    assert course.run.segmentation is not None  # a tracker that gives masks, and a truth of masks
    values: Values = course.run.segmentation.region_similarity
    return values


def _where(course: Course, attribute: str) -> NDArray[np.bool_]:
    none = np.zeros(len(similarity(course)), bool)
    return np.asarray(course.truth.attributes.get(attribute, none))


def _near_patch(course: Course) -> Values:
    return np.where(_where(course, PATCH), similarity(course), nan)


def _elsewhere(course: Course) -> Values:
    return np.where(_where(course, PATCH), nan, similarity(course))


SERIES = {
    "region_similarity": similarity,
    "tracked": lambda course: _at_least(similarity(course), TRACKED),
    "gone": lambda course: 1.0 - _at_least(similarity(course), GONE),
    "near_patch": _near_patch,
    "elsewhere": _elsewhere,
}
"""J; whether it is .5 or more, or below .1; J where a similar patch touches the target, or not."""


def _at_least(values: Values, least: float) -> Values:
    return np.where(np.isnan(values), nan, values >= least)


def of_run(course: Course) -> dict[str, float]:
    """What a number of a series can't say.

    `first_loss`: first frame with J below .5, the number of frames for none. `lost_by_jump`:
    whether J is below .5 in the tenth frame from the first jump of the light on, of targets that
    had more in the frame before the jump; NaN where what is asked did not arise.
    """
    values = similarity(course)
    below = np.flatnonzero(values < TRACKED)
    return {
        "first_loss": float(below[0] if len(below) else len(values)),
        "lost_by_jump": _lost_by_jump(values, np.flatnonzero(_where(course, JUMP))),
    }


def _lost_by_jump(values: Values, jumps: NDArray[np.intp]) -> float:
    judged = jumps[:1] + AFTER - 1
    if not len(judged) or judged[0] >= len(values):
        return nan
    before, after = values[jumps[0] - 1], values[judged[0]]
    # The first frame, which is given, has no similarity: there the target was not lost.
    return nan if before < TRACKED or np.isnan(after) else float(after < TRACKED)


def scores(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs with `lighting`, `shown` and `varied`.

    The ellipse's knob `light` is called `lighting`: no claim is judged light by light. `shown` is
    the sequence with its variant, without scene; `varied` what of a tracker is not its preset's.
    """
    return runs.assign(
        lighting=runs["light"],
        light="even",
        shown=[_without(name, "scene") for name in runs["name"]],
        varied=[_without(text, "preset").partition(":")[2] for text in runs["text"]],
    )


def _without(text: str, key: str) -> str:
    name, options = parse_text(text)
    return format_text(name, {k: value for k, value in options.items() if k != key})


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """The one-dimensional example; runs by patches, and by deviations; times of a frame."""
    effort = context.effort
    jobs = effort.jobs or os.cpu_count() or 1
    found = example_tables.measure(context.folder, jobs, quick=effort.quick)
    association = found["one-dimensional-association"]
    # A course is what a scene is: the unit of evidence.
    found["one-dimensional-association"] = association.assign(
        sequence="one dimension", scene=association["repetition"], repetition=0
    )
    return found | {
        "mo-9": patches(context.scores),
        "mo-23": deviations(context.scores),
        "times": _times(context),
    }


def patches(runs: pd.DataFrame) -> pd.DataFrame:
    """Region similarity by whether a similar patch is at the target: `patch`, two rows a run."""
    known = runs[runs["near_patch"].notna()]
    return pd.concat(
        [
            known.assign(patch=patch, region_similarity=known[column])
            for patch, column in (("touching", "near_patch"), ("apart", "elsewhere"))
        ],
        ignore_index=True,
    )


def deviations(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs by whose `deviations` of the dynamics they have, all as those of their preset."""
    ours = runs[runs["tracker"] == "moreno2005"]
    exchanged = ours["experiments"].str.contains("-learnt,")
    pieces = [ours[~exchanged].assign(deviations=ours["preset"].map(PRESETS))]
    for preset, other in zip(PRESETS, reversed(PRESETS.values()), strict=True):
        rows = ours[exchanged & (ours["preset"] == preset)]
        own = _spreads(contestant(f"moreno2005:preset={preset}").parameters)
        pieces.append(as_run(rows, **own).assign(deviations=other))
    return pd.concat(pieces, ignore_index=True)


def _spreads(parameters: Mapping[str, object]) -> dict[str, object]:
    """Parameters that say how far the dynamics stray."""
    return {key: value for key, value in parameters.items() if key.endswith("_spread")}


def _times(context: Context) -> pd.DataFrame:
    """CPU times of a frame, mean and median of a run that no load disturbed."""
    name = context.description.experiment("time")
    frames = frame_times(context.results / name, context.asked[name])
    by_run = frames.groupby(["tracker", "sequence", "repetition"], sort=False)["seconds"]
    times = by_run.agg(milliseconds="mean", median="median").reset_index()
    times[["milliseconds", "median"]] *= 1e3
    return times.assign(text=times["tracker"], tracker=times["tracker"].str.partition(":")[0])
