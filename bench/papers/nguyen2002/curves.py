"""Numbers over frames of the recording, and outliers as a sign of an occlusion in the clips."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.evaluation.record import Run, Trace
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.strips import (
    EXPERIMENT,
    FEATURES,
    PRESETS,
    RECORDING,
    runs_by_features,
)
from bench.papers.stored import StoredRuns
from bench.store.truth import StoredTruth
from reports.curves import roc_plot
from reports.series import series_grid

__all__ = ["loss_plot", "outlier_plot", "overlap_plot", "roc_points", "sign_plot"]

TRACES: tuple[Trace, ...] = ("revised", "online")
GAMMA = 0.25
HIDDEN = 0.5  # visible share of the target below which a frame is shaded

Values = NDArray[np.float64]
OverFrames = Callable[[Run, StoredTruth, Trace], Values]


def overlap_plot(stored: StoredRuns) -> Figure | None:
    """Overlap over frames, in the end and at once; None without runs."""
    series = _series(stored, _overlap, TRACES)
    if series.empty:
        return None
    return series_grid(
        series,
        f"Experiment 1, {RECORDING}, scene 0: overlap with the target, of all features",
        "overlap",
        list(FEATURES),
        {},
        row_height=2.0,
        shades=_shades(stored),
    )


def outlier_plot(stored: StoredRuns) -> Figure | None:
    """Share of outliers over frames in which none is declared; None without runs."""
    series = _series(stored, _outliers, ("online",))
    if series.empty:
        return None
    return series_grid(
        series.assign(reading="share of"),
        f"Section 2.4, {RECORDING}, scene 0: share of outliers in the frames that were compared "
        "online; where an occlusion is declared there is a gap; a line that is missing is one "
        "of features by which it is declared in all frames but few",
        "outliers",
        list(FEATURES),
        {},
        row_height=2.8,
        shades=_shades(stored),
        level=("γ", GAMMA),
    )


def loss_plot(scores: pd.DataFrame) -> Figure | None:
    """Share of the scenes in which the target was never lost up to a frame; None without runs.

    Parameters
    ----------
    scores : DataFrame
        See `scores.tidy_scores`.
    """
    chosen = scores[(scores["sequence"] == RECORDING) & (scores["variant"] == "")]
    pieces = []
    for words, preset in PRESETS.items():
        for trace in TRACES:
            for label, features in FEATURES.items():
                runs = chosen[(chosen["preset"] == preset) & (chosen["trace"] == trace)]
                runs = runs[_has_features(runs, features)].dropna(subset=["first_loss"])
                if len(runs):
                    frames = np.arange(int(runs["frames"].max()))
                    kept = runs["first_loss"].to_numpy()[:, np.newaxis] > frames
                    rows = {"frame": frames, "value": kept.mean(axis=0), "repetition": 0}
                    labels = {"label": label, "reading": trace, "scene": words}
                    pieces.append(pd.DataFrame(rows).assign(**labels))
    if not pieces:
        return None
    return series_grid(
        pd.concat(pieces, ignore_index=True),
        f"Experiment 1, {RECORDING}: share of {chosen['scene'].nunique()} scenes in which the "
        "target has not been lost (the centre outside the box in ten visible frames in a row)",
        "share",
        list(FEATURES),
        {},
        row_height=2.0,
    )


def sign_plot(tables: Mapping[str, pd.DataFrame]) -> Figure | None:
    """Share of outliers as a sign of an occlusion, by threshold; None where it was not measured.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        Of `checks`, `ng-15`.
    """
    frames = tables.get("ng-15")
    if frames is None:
        return None
    labels = {features: label for label, features in FEATURES.items()}
    return roc_plot(
        pd.concat(
            roc_points(rows).assign(label=labels[str(features)])
            for features, rows in frames.groupby("features", sort=False)
        ),
        "Section 2.4, as written: more outliers than a threshold, as a sign that half of the "
        "target or more is hidden; frames of the clips in which the template was compared",
        list(FEATURES),
        f"γ = {GAMMA:g}",
    )


def roc_points(frames: pd.DataFrame) -> pd.DataFrame:
    """Hit and false rates of all thresholds between 0 and 1.

    Parameters
    ----------
    frames : DataFrame
        `hidden` (1 or 0) and `outliers` (share).

    Returns
    -------
    DataFrame
        `threshold`, `hit_rate`, `false_rate`, and `marked`, true of γ.
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


def _series(stored: StoredRuns, value_of: OverFrames, traces: tuple[Trace, ...]) -> pd.DataFrame:
    """A number over frames of the first scene: a reading a trace, a column a preset."""
    pieces = [pd.DataFrame()]
    for words in PRESETS:
        for label, run in runs_by_features(stored, words).items():
            truth = stored.truth(EXPERIMENT, run)
            for trace in traces:
                values = value_of(run, truth, trace)
                rows = pd.DataFrame({"value": values, "label": label, "repetition": 0})
                pieces.append(rows.assign(frame=rows.index, reading=trace, scene=words))
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def _shades(stored: StoredRuns) -> dict[str, dict[str, NDArray[np.bool_]]]:
    """Frames in which a lamp is off, and in which the target is hidden, by column."""
    shades = {}
    for words in PRESETS:
        for run in list(runs_by_features(stored, words).values())[:1]:
            truth = stored.truth(EXPERIMENT, run)
            shades[words] = {
                "lamp off": truth.attributes["lamp off"],
                "half hidden or more": truth.visibility < HIDDEN,
            }
    return shades


def _overlap(run: Run, truth: StoredTruth, trace: Trace) -> Values:
    return overlap(truth.boxes, run.boxes_in(trace))


def _outliers(run: Run, truth: StoredTruth, trace: Trace) -> Values:
    return np.where(run.details["occluded"] == 1, np.nan, run.details["outliers"])


def _has_features(runs: pd.DataFrame, features: str) -> "pd.Series[bool]":
    """Of scores, in which arc tangents are a definition of the invariants."""
    if features == "arctan":
        return runs["definition"] == "arctan"
    return (runs["features"] == features) & (runs["definition"] != "arctan")
