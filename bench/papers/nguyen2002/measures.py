"""What is measured of runs: success, occlusions detected, where the target was lost; and sets.

A set of 20 clips is the unit of evidence, so that a table of sets stands beside the scores.
"""

import re
from collections.abc import Iterator, Mapping
from math import nan
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.sides import run_key
from bench.evaluation.record import Trace
from bench.metrics.centre_error import centres
from bench.metrics.native import SUCCESS_OVERLAP
from bench.metrics.overlap import overlap
from bench.papers.context import Context
from bench.papers.measures import Course, Series
from bench.papers.nguyen2002.events import CLEAR, Declared, declared_in, hidden_in
from bench.statistics.intervals import mean_interval
from bench.store.truth import StoredTruth
from trackers.nguyen2002 import Nguyen2002

__all__ = ["SERIES", "failures_by_margin", "of_run", "published", "set_table", "tables", "together"]

SUCCESS, LAST = 0.9, 5
"""A run succeeds with enough overlap in this share of clear frames, and in all of the last."""

IN_VIEW = 0.75
"""Visible part from which on a target can be found again."""

SWITCH = "lamp off"
"""Attribute of frames in which one of the lamps is off."""

MOMENT = 3
"""Frames before and after a change within which something happens at its moment."""

KEPT = 20
"""Frames from the change on in which the box must stay."""

CLIP, CLIPS = "nguyen2002/clip-", "nguyen2002/clips"
"""How the names of clips begin, and what those of a set are called together."""

N_CLIPS = 20

FEATURES = {"intensity": 1, "rgb": 2, "invariants": 3, "arctan": 4}
"""Places in the order of tables."""

TABLE_1 = {"intensity": (16, 17), "rgb": (16, 17), "invariants": (11, 14)}
"""Clips tracked of 20, and occlusions detected of 21, by features."""

SECONDS = 0.005
"""A frame of section 3, on a Pentium II of 400 MHz."""

SERIES: Mapping[str, Series] = {
    "compared_outliers": lambda course: np.where(
        course.detail("occluded") == 1, nan, course.detail("outliers")
    ),
    "lamp_off": lambda course: np.asarray(course.truth.attributes[SWITCH], float),
    "half_hidden": lambda course: np.asarray(course.truth.visibility < HIDDEN, float),
}
"""Share of outliers where no occlusion is declared; whether a lamp is off, the target hidden."""

HIDDEN = 0.5  # visible share of the target below which it is half hidden or more

_PAIRED = ["sequence", "scene", "trace", "preset", "clips", "pairs", "correlation"]

Flags = NDArray[np.bool_]


def of_run(course: Course) -> dict[str, float]:
    """What is known of a finished run by one of its traces.

    A yes or no is 1 or 0, NaN where what is asked did not arise. `on_target` (share of the clear
    frames with enough overlap), `success`, `said_hidden` (share of the clear frames in which the
    tracker said at once that the target is hidden, whatever the trace), `jitter` (mean length of
    the second difference of the centre less the true one, over clear frames [pixels]), `outliers`
    (mean share in frames that the tracker trusts), `never_lost`; `occlusions`, `declared`,
    `detected` (numbers), `detected_share` (of the occlusions), `false_occlusions` (number). Where a
    lamp is off for a while: `lost_at_switch`, `lost_at_off` (at the moment of a change, or of the
    first), `lost_at_on`, `lost_elsewhere` (at another alone, at none), `kept_after_off` (share of
    the clear ones among the frames from the change on with enough overlap), `clear_after_off`
    (their number).
    """
    run, truth, trace, first_loss = (
        course.run,
        course.truth,
        course.trace,
        course.scores["first_loss"],
    )
    boxes = course.boxes
    good = overlap(truth.boxes, boxes) >= SUCCESS_OVERLAP
    clear = truth.visibility >= CLEAR
    clear[0] = False  # the box is given
    events = declared_in(run)
    trusted = run.details["occluded"] == 0
    known = {
        "on_target": float(good[clear].mean()),
        "success": float(good[clear].mean() >= SUCCESS and good[clear][-LAST:].all()),
        "said_hidden": float((~run.visible[clear]).mean()),
        "jitter": _jitter(centres(boxes) - centres(truth.boxes), clear),
        "outliers": float(run.details["outliers"][trusted].mean()) if trusted.any() else nan,
        "never_lost": float(first_loss >= len(boxes)),
    }
    known |= _occlusions(events, good & (truth.visibility >= IN_VIEW), truth, trace)
    if SWITCH in truth.attributes:
        off = truth.attributes[SWITCH]
        known |= _at_switches(off, _lost_from(events, first_loss, trace), good, clear)
    return known


def _jitter(errors: NDArray[np.float64], clear: Flags) -> float:
    """Mean length of second differences of errors (n, 2) over three clear frames in a row."""
    lengths = np.hypot(*np.diff(errors, 2, axis=0).T)
    chosen = clear[:-2] & clear[1:-1] & clear[2:]
    return float(lengths[chosen].mean()) if chosen.any() else nan


def _occlusions(
    events: list[Declared], found: Flags, truth: StoredTruth, trace: Trace
) -> dict[str, float]:
    """How those that there were, and those that were declared, fit together.

    `found` are frames in which the box is on a target in view.
    """
    hidden = hidden_in(truth.visibility)
    causes = [[event for event in events if one.causes(event)] for one in hidden]
    declared = [those for those in causes if those]
    ends = [_end(those[-1], trace) for those in declared]
    detected = sum(bool(found[end]) for end in ends if end is not None)
    return {
        "occlusions": float(len(hidden)),
        "declared": float(len(declared)),
        "detected": float(detected),
        "detected_share": detected / len(hidden) if hidden else nan,
        "false_occlusions": float(len(events) - sum(map(len, causes))),
    }


def _end(event: Declared, trace: Trace) -> int | None:
    """The frame whose box shows whether the target was found again."""
    return event.end if trace == "revised" else event.back


def _lost_from(events: list[Declared], first_loss: float, trace: Trace) -> float:
    """Where a loss began: in what was declared an occlusion the tracker follows nothing."""
    for event in events:
        end = _end(event, trace)
        if event.beginning <= first_loss and (end is None or first_loss <= end):
            return event.beginning
    return first_loss


def _at_switches(off: Flags, lost: float, good: Flags, clear: Flags) -> dict[str, float]:
    changes = np.flatnonzero(np.diff(off.astype(np.int8))) + 1
    at_moment = np.abs(changes - lost) <= MOMENT
    after = np.zeros_like(clear)
    after[changes[0] : changes[0] + KEPT] = True
    return {
        "lost_at_switch": float(at_moment.any()),
        "lost_at_off": float(at_moment[0]),
        "lost_at_on": float(at_moment[1:].any() and not at_moment[0]),
        "lost_elsewhere": float(not at_moment.any()),
        "kept_after_off": float(good[after & clear].mean()) if (after & clear).any() else nan,
        "clear_after_off": float((after & clear).sum()),
    }


def tables(context: Context) -> dict[str, pd.DataFrame]:
    """Sets; what was measured on clips by sets; and whether failures go with lost margins."""
    by_sets = {
        name: table.assign(sequence=[together(one) for one in table["sequence"]])
        for name, table in context.tables.items()
        if "sequence" in table
    }
    sets = {"sets": set_table(context.scores)}
    if "ng-9" in by_sets:
        sets["ng-9-failures"] = failures_by_margin(by_sets["ng-9"], context.scores)
    return by_sets | sets


def set_table(scores: pd.DataFrame) -> pd.DataFrame:
    """Scores by set of 20 clips; a scene of the recording is a set of one.

    What is known of tracker and trace, `sequence` (`nguyen2002/clips` for all clips), `scene`;
    `clips`, `tracked` (numbers), `tracked_share`; `occlusions`, `declared`, `detected` (numbers),
    `detected_share`; means over the clips of what else is known of runs. A set of which a clip
    failed, or is not there, is left out.
    """
    good = scores[scores["failure"] == ""]
    good = good.assign(sequence=[together(one) for one in good["sequence"]])
    labels = ["text", "trace", "sequence", "scene"]
    groups, sums = good.groupby(labels, sort=False), ["success", "occlusions", "declared"]
    sets = groups.agg(clips=("success", "size")).join(groups[[*sums, "detected"]].sum())
    known = groups.first().drop(columns=[*sums, "detected"])
    means = list(map(str, known.select_dtypes("float").columns))
    sets = known.drop(columns=means).join(groups[means].mean()).join(sets).reset_index()
    sets = sets[(sets["sequence"] != CLIPS) | (sets["clips"] == N_CLIPS)]
    published = {_as_written(features): numbers for features, numbers in TABLE_1.items()}
    told = [published.get(key, (nan, nan)) for key in sets["settled"]]
    sets = sets.rename(columns={"success": "tracked"}).assign(
        tracked_share=sets["success"] / sets["clips"],
        detected_share=sets["detected"] / sets["occlusions"],
        published_tracked=[clips for clips, _ in told],
        published_detected=[occlusions for _, occlusions in told],
    )
    order = sets[["sequence", "features", "preset"]].replace({"features": FEATURES})
    places = order.sort_values(["sequence", "features", "preset"], kind="stable").index
    return sets.loc[places].reset_index(drop=True)


def _as_written(features: str) -> str:
    return run_key(f"nguyen2002:preset=as-written:features={features}")


def together(sequence: str) -> str:
    """What a sequence is counted under: clips by sets."""
    return CLIPS if sequence.startswith(CLIP) else sequence


def failures_by_margin(margins: pd.DataFrame, scores: pd.DataFrame) -> pd.DataFrame:
    """Rank correlation, over a set's clips, of what the invariants lose of margin and of target.

    Both are differences to RGB: of the mean `margin` (`ng-9`, of the clips that count), and of the
    share of clear frames on the target, of runs with presets as they are. By set, trace and preset:
    `sequence` (of all clips), `scene`, `trace`, `preset`, `clips` (number), and in a row each
    `pairs` (`of a clip`, `by chance`) with their `correlation`, which is 0 by chance. Without the
    sets in which all clips fare alike.
    """
    by_clip = margins.pivot_table("margin", "name", "features")
    lost = by_clip["rgb"] - by_clip["invariants"]
    compared = [
        run_key(f"nguyen2002:preset={preset}:features={features}")
        for preset in Nguyen2002.presets
        for features in ("rgb", "invariants")
    ]
    rows = [
        {**labels, "clips": len(both), "pairs": pairs, "correlation": value}
        for labels, both in _sets(lost, scores[scores["settled"].isin(compared)])
        for pairs, value in (("of a clip", _rank_correlation(both)), ("by chance", 0.0))
    ]
    return pd.DataFrame(rows, columns=_PAIRED)


def _sets(
    lost: "pd.Series[float]", scores: pd.DataFrame
) -> Iterator[tuple[dict[str, object], pd.DataFrame]]:
    """Sets in which clips differ in either loss: their labels, and both losses by clip."""
    for (scene, trace, preset), runs in scores.groupby(["scene", "trace", "preset"], sort=False):
        shares = runs.pivot_table("on_target", "name", "features")
        if not {"rgb", "invariants"} <= set(shares):
            continue
        failing = shares["rgb"] - shares["invariants"]
        both = pd.DataFrame({"margin": lost, "target": failing}).dropna()
        if (both.min() < both.max()).all():
            labels = {"sequence": CLIPS, "scene": scene, "trace": trace, "preset": preset}
            yield labels, both


def _rank_correlation(both: pd.DataFrame) -> float:
    return float(both["margin"].corr(both["target"], method="spearman"))


def published(context: Context) -> list[dict[str, Any]]:
    """Table 1 as written by both traces, and the time of section 3, for scripts."""
    sets, rows = context.tables["sets"], []
    for features, numbers in TABLE_1.items():
        written = sets["settled"] == _as_written(features)
        clips = sets[written & (sets["sequence"] == CLIPS)]
        for trace in ("revised", "online"):
            chosen = clips[clips["trace"] == trace]
            columns = ("clips tracked of 20", "tracked"), ("occlusions detected of 21", "detected")
            for (words, metric), number in zip(columns, numbers, strict=True):
                column = f"{words}, {trace} boxes"
                rows.append(_row("table-1", features, column, number, chosen[metric]))
    if "ng-10" in context.tables:
        for label, runs in context.tables["ng-10"].groupby("features", sort=False):
            seconds = runs["decoded"].mean() / 1e3
            rows.append(_row("time", str(label), "seconds a frame", SECONDS, [seconds]))
    return rows


def _row(
    table: str, label: str, column: str, published: float, values: "pd.Series[float] | list[float]"
) -> dict[str, Any]:
    """A published number beside the mean of ours and its interval; None for what there is not.

    No fewer clips than none are tracked, and no more than there are.
    """
    interval = list(mean_interval(values)) if len(values) > 1 else None
    if interval and (clips := re.search(r" of (\d+),", column)):
        interval = np.clip(interval, 0.0, float(clips[1])).tolist()
    return {
        "table": table,
        "label": label,
        "column": column,
        "published": published,
        "measured": float(np.mean(values)) if len(values) else None,
        "interval": interval,
    }
