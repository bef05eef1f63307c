"""The paper's Fig. 1, and pictures of our own: boxes of all features, and numbers over frames."""

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.claims.sides import run_key
from bench.evaluation.record import Run, Trace
from bench.papers.context import Context
from bench.papers.nguyen2002.events import hidden_in
from bench.store.truth import StoredTruth
from datasets.interface import Image
from reports.curves import roc_plot
from reports.film_strip import film_strip
from reports.overlay import TRUTH
from reports.series import series_grid

__all__ = ["chosen_frames", "losses", "roc_points", "sign", "strips"]

EXPERIMENT = "nguyen2002-figure-1"
RECORDING = "nguyen2002/lights"
FEATURES = {
    "intensity": "intensity",
    "RGB": "rgb",
    "c1c2c3": "invariants",
    "arctan of c1c2c3": "arctan",
}
"""By what they are called."""

CALLED = {features: label for label, features in FEATURES.items()}
PAPERS = "c1c2c3"
PRESETS = {"as written": "as-written", "recommended": "recommended"}
TRACES: dict[Trace, str] = {"online": "said at once (online)", "revised": "in the end (revised)"}

BEFORE, AFTER = 3, 10  # frames from an occlusion, and from the switching of a lamp
GAMMA = 0.25

Strip = NDArray[np.uint8]
Values = NDArray[np.float64]


def _text(words: str, label: str) -> str:
    return f"nguyen2002:preset={PRESETS[words]}:features={FEATURES[label]}"


def _first_runs(context: Context) -> tuple[dict[str, dict[str, Run]], StoredTruth | None]:
    """Runs on the recording's first scene by preset and features, and their truth."""
    runs: dict[str, dict[str, Run]] = {}
    truth = None
    for words in PRESETS:
        for label in FEATURES:
            for run in context.stored.of(EXPERIMENT, RECORDING, _text(words, label)):
                runs.setdefault(words, {})[label] = run
                truth = truth or context.stored.truth(EXPERIMENT, run)
    return runs, truth


def strips(context: Context) -> dict[str, Strip | None]:
    """Fig. 1, and the same as recommended: a row of frames for each kind of features."""
    runs, truth = _first_runs(context)
    names = {"as written": "figure-1", "recommended": "figure-1-recommended"}
    image_of = cache(datasets.load(RECORDING).__getitem__)  # six rows show the same frames
    return {
        name: _strip(image_of, runs[words], truth, words) if truth and words in runs else None
        for words, name in names.items()
    }


def _strip(
    image_of: Callable[[int], Image], runs: Mapping[str, Run], truth: StoredTruth, words: str
) -> Strip:
    """The paper's features come first."""
    frames = chosen_frames(truth)
    return np.vstack(
        [
            film_strip(
                image_of,
                list(frames),
                {TRUTH: truth.boxes, **{said: run.boxes_in(one) for one, said in TRACES.items()}},
                f"Fig. 1, {label}, {words}, {RECORDING}, scene 0",
                len(frames),
                words=frames,
            )
            for label, run in sorted(runs.items(), key=lambda one: one[0] != PAPERS)
        ]
    )


def chosen_frames(truth: StoredTruth) -> dict[int, str]:
    """Frames of Fig. 1 and what they show: a to c of an occlusion, d of a lamp; and one more."""
    frames: dict[int, str] = {}
    last = len(truth.boxes) - 1
    for occlusion in hidden_in(truth.visibility)[:1]:
        frames |= {
            max(0, occlusion.first - BEFORE): "a) before",
            (occlusion.first + occlusion.last) // 2: "b) hidden",
            min(last, occlusion.last + AFTER): "c) after",
        }
    lamp = truth.attributes["lamp off"]
    for frame in (np.flatnonzero(lamp[1:] != lamp[:-1]) + 1).tolist():
        words = "d) lamp off" if lamp[frame] else "lamp on again"
        frames[min(last, frame + AFTER)] = words
    return dict(sorted(frames.items()))


def losses(context: Context) -> Figure | None:
    """Share of the scenes in which the target was never lost up to a frame; None without runs."""
    scores = context.scores[context.scores["sequence"] == RECORDING].dropna(subset=["first_loss"])
    pieces = []
    for words in PRESETS:
        for label in FEATURES:
            runs = scores[scores["settled"] == run_key(_text(words, label))]
            for trace, rows in runs.groupby("trace", sort=False):
                frames = np.arange(int(rows["frames"].max()))
                kept = rows["first_loss"].to_numpy()[:, np.newaxis] > frames
                series = {"frame": frames, "value": kept.mean(axis=0), "repetition": 0}
                labels = {"label": label, "reading": trace, "scene": words}
                pieces.append(pd.DataFrame(series).assign(**labels))
    if not pieces:
        return None
    return series_grid(
        pd.concat(pieces, ignore_index=True),
        f"Experiment 1, {RECORDING}: share of {scores['scene'].nunique()} scenes in which the "
        "target has not been lost (the centre outside the box in ten visible frames in a row)",
        "share",
        list(FEATURES),
        {},
        row_height=2.0,
    )


def sign(context: Context) -> Figure | None:
    """Share of outliers as a sign of an occlusion, by threshold; None where it was not measured."""
    if "ng-15" not in context.tables:
        return None
    return roc_plot(
        pd.concat(
            roc_points(rows).assign(label=CALLED[str(features)])
            for features, rows in context.tables["ng-15"].groupby("features", sort=False)
        ),
        "Section 2.4, as written: more outliers than a threshold, as a sign that half of the "
        "target or more is hidden; frames of the clips in which the template was compared",
        list(FEATURES),
        f"γ = {GAMMA:g}",
    )


def roc_points(frames: pd.DataFrame) -> pd.DataFrame:
    """Hit and false rates of `outliers` (share) above a threshold as a sign of `hidden` (1 or 0).

    A row a `threshold` between 0 and 1: `hit_rate`, `false_rate`, and `marked`, true of γ.
    """
    thresholds = np.linspace(1, 0, 101)
    hidden = frames["hidden"] == 1

    def rates(rows: pd.DataFrame) -> Values:
        exceeds = rows["outliers"].to_numpy()[:, np.newaxis] > thresholds
        return np.asarray(exceeds.mean(axis=0) if len(rows) else np.full(len(thresholds), np.nan))

    return pd.DataFrame(
        {
            "threshold": thresholds,
            "hit_rate": rates(frames[hidden]),
            "false_rate": rates(frames[~hidden]),
            "marked": np.isclose(thresholds, GAMMA),
        }
    )
