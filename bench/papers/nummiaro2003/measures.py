"""What claims and tables ask of the runs that `paper.toml` can't say.

Of a run: sizes, updates, what became of the target when it was hidden. Of all of them: which serve
several readings of the text.
"""

from math import nan
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error, centre_inside
from bench.metrics.native import first_loss
from bench.papers.context import Context
from bench.papers.measures import Course
from bench.papers.nummiaro2003.checks import CHECKS
from bench.papers.runs import as_run
from bench.store.truth import StoredTruth
from trackers.histograms.ellipses import EllipseCounts
from trackers.histograms.target_model import TargetModel

__all__ = ["CHECKS", "GONE", "HIDDEN", "NAMES", "SERIES", "Hiding", "hidings", "of_run"]
__all__ += ["published", "scores", "tables"]

Flags = NDArray[np.bool_]
Array = NDArray[np.float64]

HIDDEN = 0.5  # visible fraction below which the target is hidden
GONE = 0.1  # likewise, completely
CLEAR = 0.8  # visible fraction above which it is in view again
PARTLY = 0.3, 0.9  # visible fractions between which it is partly hidden

RECOVERY, BRIDGE, END = 30, 10, 20  # frames
SETTLED = 5  # frames in a row with the centre inside that make a recovery: one alone is chance
FAST = 0.2  # share of the frames that are called fast

NAMES = (
    *("frames", "first_loss", "size_error", "size_bias", "size_correlation", "centre_rms"),
    *("inside_partly_hidden", "inside_fast", "inside_otherwise"),
    *("good_frames", "good_updates", "other_frames", "other_updates", "waiting_frames"),
    *("update_share", "recovered", "right_at_end", "count_fell", "initialised"),
    *("tracking_again", "bridged", "count_fell_shortly", "count_fell_at_end"),
)
"""What is known of a run; see `of_run`."""

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

HEAD = "nummiaro2003/head:pace=calm"
HEAD_LENGTH = 450  # frames of the paper's Fig. 10, through all of which the head is followed

SERIES = {"true_half_width": lambda course: course.truth.boxes[:, 2] / 2}
"""Hx of the truth [pixels]."""


class Hiding(NamedTuple):
    """A time for which the target is hidden: from one frame to before another, how completely."""

    first: int
    stop: int
    complete: bool


def of_run(course: Course) -> dict[str, float]:
    """What happened in a run, of any tracker.

    NaN where what is asked did not arise, or the tracker does not say:

    - `frames`, `first_loss`: the length, and what of it is before the loss, of the frames
      alone in which the target is there;
    - `size_error`, `size_bias`: mean of |Hx - truth| and of Hx - truth over the truth;
      `size_correlation` with the truth; `centre_rms`: root of the mean square [pixels];
    - `inside_partly_hidden`, `inside_fast`, `inside_otherwise`: shares of such frames with
      the centre inside; fast is the fifth in which the target moves most in the image;
    - `good_frames`, `other_frames`: those in which it tracks, half of the target or more is
      visible and the centre inside, and the others; `good_updates`, `other_updates`: those of
      either in which the model was updated; `waiting_frames`: others in which the tracker
      initialises; `update_share`: of the frames in which it tracks;
    - `recovered`: tracking, five frames in a row inside, up to 30 frames after the first
      complete hiding; `right_at_end`: share inside of the last 20 frames in view;
    - `count_fell`, `initialised`: fewer than b N positive particles, or the mode, in a frame
      of that hiding; `tracking_again`: the mode 30 frames after it;
    - `bridged`: inside ten frames after each shorter hiding, and never initialising till
      then, of those before which it tracked and was inside; `count_fell_shortly`: fewer than
      b N in a frame of one of these;
    - `count_fell_at_end`: fewer than b N up to ten frames after the target left.
    """
    run, truth = course.run, course.truth
    present: Flags = np.asarray(np.isfinite(truth.boxes).all(axis=1))
    evaluated = present & (np.arange(len(present)) > np.flatnonzero(present)[0])
    inside = centre_inside(truth.regions.get("full", truth.boxes), run.boxes)
    lost = first_loss(inside, evaluated, truth.visibility)
    said = dict.fromkeys(NAMES, nan)
    said |= {"frames": float(present.sum()), "first_loss": float(present[:lost].sum())}
    said |= _sizes(run.boxes, truth.boxes, evaluated) | _where_inside(truth, inside, evaluated)
    if "mode" in run.details:
        said |= _updates(run, truth, inside, present) | _occlusion(run, truth, inside, present)
    return said


def hidings(visibility: Array, first: int, stop: int) -> list[Hiding]:
    """Times for which the target is hidden from its first frame to before `stop`, in order.

    Where the visible fraction (n,) is NaN the target counts as visible; what reaches until it is
    gone is its leaving, and no hiding.
    """
    hidden = np.flatnonzero(visibility[first:stop] < HIDDEN) + first
    times = np.split(hidden, np.flatnonzero(np.diff(hidden) > 1) + 1)
    return [
        Hiding(int(time[0]), int(time[-1]) + 1, bool((visibility[time] < GONE).any()))
        for time in times
        if len(time) and time[-1] + 1 < stop
    ]


def _sizes(boxes: Array, truth: Array, evaluated: Flags) -> dict[str, float]:
    widths, true = boxes[evaluated, 2], truth[evaluated, 2]
    error = widths / true - 1
    changes = np.ptp(widths) > 0 and np.ptp(true) > 0
    distances = centre_error(truth[evaluated], boxes[evaluated])
    return {
        "size_error": float(np.abs(error).mean()),
        "size_bias": float(error.mean()),
        "size_correlation": float(np.corrcoef(widths, true)[0, 1]) if changes else nan,
        "centre_rms": float(np.sqrt((distances**2).mean())),
    }


def _where_inside(truth: StoredTruth, inside: Flags, evaluated: Flags) -> dict[str, float]:
    visible = truth.visibility
    partly = evaluated & (visible >= PARTLY[0]) & (visible <= PARTLY[1])
    centres = truth.boxes[:, :2] + truth.boxes[:, 2:] / 2
    steps = np.r_[nan, np.hypot(*np.diff(centres, axis=0).T)]
    known = evaluated & np.isfinite(steps)
    fast = known & (steps >= np.quantile(steps[known], 1 - FAST))
    return {
        "inside_partly_hidden": _share(inside[partly]),
        "inside_fast": _share(inside[fast]),
        "inside_otherwise": _share(inside[known & ~fast]),
    }


def _updates(run: Run, truth: StoredTruth, inside: Flags, present: Flags) -> dict[str, float]:
    after = np.arange(len(present)) > np.flatnonzero(present)[0]
    seen = ~(truth.visibility < HIDDEN) & present
    tracks = run.details["mode"] > 0  # there is no update while it initialises
    good = after & seen & inside & tracks
    every_other = after & ~(seen & inside)
    other = every_other & tracks
    updated = run.details["updated"]
    return {
        "good_frames": float(good.sum()),
        "good_updates": float(np.nansum(updated[good])),
        "other_frames": float(other.sum()),
        "other_updates": float(np.nansum(updated[other])),
        "waiting_frames": float((every_other & ~tracks).sum()),
        "update_share": _share(updated[after & tracks]),
    }


def _occlusion(run: Run, truth: StoredTruth, inside: Flags, present: Flags) -> dict[str, float]:
    visible = np.where(present, truth.visibility, 0.0)
    first, stop = int(np.flatnonzero(present)[0]), int(np.flatnonzero(present)[-1]) + 1
    every = hidings(visible, first, stop)
    complete = next((hiding for hiding in every if hiding.complete), None)
    if complete is None:
        return {}
    parameters = run.identity.parameters
    few = run.details["positive_appearances"] < parameters["kick_off"] * parameters["particles"]
    tracks = run.details["mode"] > 0
    follows = inside & tracks
    hidden = np.arange(complete.first, complete.stop)
    hidden = hidden[visible[hidden] < GONE]
    clear = np.flatnonzero(visible > CLEAR)
    back = int(clear[clear >= complete.stop][0])
    in_a_row = np.convolve(follows[back : back + RECOVERY + 1], np.ones(SETTLED))
    said = {
        "recovered": float(in_a_row.max() == SETTLED),
        "right_at_end": _share(inside[clear[-END:]]),
        "count_fell": float(few[hidden].any()),
        "initialised": float((~tracks[hidden]).any()),
        "tracking_again": float(tracks[back + RECOVERY]),
    }
    short = [hiding for hiding in every if hiding.first > back and follows[hiding.first - 1]]
    if short:
        said["bridged"] = float(all(_is_bridged(hiding, inside, tracks) for hiding in short))
        fell = [few[hiding.first : hiding.stop].any() for hiding in short]
        said["count_fell_shortly"] = float(any(fell))
    if stop < len(present):
        said["count_fell_at_end"] = float(few[stop : stop + BRIDGE + 1].any())
    return said


def _is_bridged(hiding: Hiding, inside: Flags, tracks: Flags) -> bool:
    end = hiding.stop + BRIDGE
    return bool(inside[min(end, len(inside) - 1)] and tracks[hiding.first : end + 1].all())


def _share(flags: Flags | Array) -> float:
    return float(flags.mean()) if len(flags) else nan


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


def _nearer(runs: pd.DataFrame) -> "pd.Series[float]":
    """Among runs with update, 1 in scenes in which the mean error of Hx is smaller than without."""
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
