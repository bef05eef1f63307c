"""What is measured of the runs beside their scores, and tables that claims read; equation 2."""

import os
from collections.abc import Mapping
from math import nan

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.experiments.contestant import contestant
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.moreno2005 import example
from bench.papers.runs import as_run
from bench.papers.timing import tracker_times
from datasets.text_form import format_text, parse_text

__all__ = ["DEPENDENCES", "SERIES", "STATES", "deviations", "distance", "factorisation", "joint"]
__all__ += ["of_run", "patches", "scores", "tables"]

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


DEPENDENCES = ("equation 1 alone", "and p(x₁ | z₁, z₂) = p(x₁ | z₁)")
"""What is assumed: as the paper writes, and what its proof needs besides."""

STATES = 4  # of every feature and measurement
MODELS = 100


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

    `first_loss`: first frame with J below .5, the number of frames for none. `lost`: whether there
    is one. `lost_by_jump`:
    whether J is below .5 in the tenth frame from the first jump of the light on, of targets that
    had more in the frame before the jump; NaN where what is asked did not arise.
    """
    values = similarity(course)
    below = np.flatnonzero(values < TRACKED)
    return {
        "first_loss": float(below[0] if len(below) else len(values)),
        "lost": float(len(below) > 0),
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
    found = example.measure(context.folder, jobs, effort)
    association = found["one-dimensional-association"]
    # A course is what a scene is: the unit of evidence.
    found["one-dimensional-association"] = association.assign(
        sequence="one dimension", scene=association["repetition"], repetition=0
    )
    return (
        found
        | {
            "mo-9": patches(context.scores),
            "mo-23": deviations(context.scores),
            "one-dimensional-factorisation": factorisation(),
        }
        | _times(context)
    )


def _times(context: Context) -> dict[str, pd.DataFrame]:
    if context.description.experiment("time") not in context.asked:  # a quick look times nothing
        return {}
    return {"times": tracker_times(context, "time", frames=10)}


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


def factorisation() -> pd.DataFrame:
    """Equation 2 on random discrete models, where all sums can be done: the greatest distances.

    By equation 1 the second measurement depends on the first feature, z₂ = z₂(x₁, z₁). By Bayes'
    rule p(x₁, x₂ | z₁, z₂) = p(x₂ | x₁, z₁, z₂) p(x₁ | z₁, z₂); the proof goes on with p(x₁ | z₁)
    in the place of the latter. Nothing in equation 1 says so: what is measured of x₂ tells of x₁.
    """
    rows = []
    for dependence in DEPENDENCES:
        generator = np.random.default_rng(0)
        models = (joint(generator, informs=dependence == DEPENDENCES[0]) for _ in range(MODELS))
        rows.append({"dependence": dependence, "distance": max(map(distance, models))})
    return pd.DataFrame(rows)


def joint(generator: np.random.Generator, *, informs: bool) -> Values:
    """A random p(x₁, x₂, z₁, z₂) with the dependences of equation 1, shape (4, 4, 4, 4).

    `informs` is whether z₂ tells of x₁. Where not, x₂ depends on x₁, and z₂ on both, so that
    p(z₂ | x₁, z₁) is the same for all x₁.
    """
    first = generator.dirichlet(np.ones(STATES))
    measured = generator.dirichlet(np.ones(STATES), STATES)  # z₁ given x₁
    if informs:
        second = generator.dirichlet(np.ones(STATES), (STATES, STATES))  # x₂ given x₁, z₁
        seen = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # z₂ given x₁, x₂, z₁
        both = second[..., np.newaxis] * seen.transpose(0, 2, 1, 3)
    else:
        total = generator.dirichlet(np.ones(STATES), STATES)  # z₂ given z₁
        shares = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # x₂ given x₁, z₁, z₂
        both = (total[np.newaxis, ..., np.newaxis] * shares).transpose(0, 1, 3, 2)
    # `both` is p(x₂, z₂ | x₁, z₁), axes x₁, z₁, x₂, z₂.
    whole = (first[:, np.newaxis] * measured)[..., np.newaxis, np.newaxis] * both
    return np.ascontiguousarray(whole.transpose(0, 2, 1, 3))


def distance(model: Values) -> float:
    """Greatest total variation, over measurements, of posterior and product of equation 2.

    Of a model p(x₁, x₂, z₁, z₂), shape (n, n, n, n).
    """
    posterior = model / model.sum(axis=(0, 1))
    of_first = model.sum(axis=(1, 3))
    first = of_first / of_first.sum(axis=0)  # p(x₁ | z₁)
    second = model / model.sum(axis=1, keepdims=True)  # p(x₂ | x₁, z₁, z₂)
    product = first[:, np.newaxis, :, np.newaxis] * second
    return float(0.5 * np.abs(posterior - product).sum(axis=(0, 1)).max())
