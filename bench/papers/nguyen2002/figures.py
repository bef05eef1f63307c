"""The paper's Fig. 1, and pictures of our own: boxes of all features, and numbers over frames."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run, Trace
from bench.metrics.overlap import overlap
from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.nguyen2002.events import hidden_in
from bench.papers.stored import StoredRuns
from bench.store.truth import StoredTruth
from reports.curves import roc_plot
from reports.film_strip import film_strip
from reports.overlay import TRUTH
from reports.series import series_grid

__all__ = [
    "NUMBERS",
    "Pictures",
    "chosen_frames",
    "draw",
    "loss_plot",
    "roc_points",
    "sign_plot",
]

NUMBERS = (1,)
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
STRIPS = {"as written": "figure-1", "recommended": "figure-1-recommended"}
TRACES: dict[Trace, str] = {"online": "said at once (online)", "revised": "in the end (revised)"}

BEFORE, AFTER = 3, 10  # frames from an occlusion, and from the switching of a lamp
GAMMA = 0.25
HIDDEN = 0.5  # visible share of the target below which a frame is shaded

Values = NDArray[np.float64]


def draw(
    results: Path,
    folder: Path,
    asked: Asked,
    tables: Mapping[str, pd.DataFrame],
    scores: pd.DataFrame,
) -> list[Path]:
    """Draw all pictures whose runs were asked for and are there.

    Parameters
    ----------
    results, folder : Path
        Of all experiments, and where to.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    tables : mapping of str to DataFrame
        Of what is measured on scenes, `ng-15`.
    scores : DataFrame
        See `scores.tidy_scores`; those of the recording are drawn.
    """
    pictures = Pictures(StoredRuns(results, asked))
    plots = {
        "lights-overlap": pictures.overlaps(),
        "lights-outliers": pictures.outliers(),
        "lights-losses": loss_plot(scores),
        "outliers-as-sign": sign_plot(tables),
    }
    return write_pictures(folder, plots, pictures.strips())


class Pictures:
    """Pictures of the runs on the recording's first scene."""

    def __init__(self, stored: StoredRuns) -> None:
        self.runs: dict[str, dict[str, Run]] = {}
        for words, preset in PRESETS.items():
            texts = {
                label: f"nguyen2002:preset={preset}:features={features}"
                for label, features in FEATURES.items()
            }
            found = {k: stored.of(EXPERIMENT, RECORDING, text) for k, text in texts.items()}
            there = {label: runs[0] for label, runs in found.items() if runs}
            if there:
                self.runs[words] = there
                self.truth = stored.truth(EXPERIMENT, next(iter(there.values())))

    def strips(self) -> dict[str, NDArray[np.uint8]]:
        """Fig. 1 by name: a row of frames for each kind of features, the paper's first."""
        return {STRIPS[words]: self._strip(runs, words) for words, runs in self.runs.items()}

    def _strip(self, runs: Mapping[str, Run], words: str) -> NDArray[np.uint8]:
        sequence = datasets.load(RECORDING)
        frames = chosen_frames(self.truth)
        return np.vstack(
            [
                film_strip(
                    sequence.__getitem__,
                    list(frames),
                    {TRUTH: self.truth.boxes}
                    | {said: run.boxes_in(trace) for trace, said in TRACES.items()},
                    f"Fig. 1, {label}, {words}, {RECORDING}, scene 0",
                    len(frames),
                    words=frames,
                )
                for label, run in sorted(runs.items(), key=lambda one: one[0] != PAPERS)
            ]
        )

    def overlaps(self) -> Figure | None:
        """Overlap over frames, in the end and at once; None without runs."""
        traces: tuple[Trace, ...] = ("revised", "online")
        series = [
            self._series(partial(self._overlap, trace=trace)).assign(reading=trace)
            for trace in traces
        ]
        return self._over_frames(
            pd.concat(series),
            f"Experiment 1, {RECORDING}, scene 0: overlap with the target, of all features",
            "overlap",
            2.0,
        )

    def _overlap(self, run: Run, trace: Trace) -> Values:
        return overlap(self.truth.boxes, run.boxes_in(trace))

    def outliers(self) -> Figure | None:
        """Share of outliers over frames in which no occlusion is declared; None without runs."""
        series = self._series(
            lambda run: np.where(run.details["occluded"] == 1, np.nan, run.details["outliers"])
        )
        return self._over_frames(
            series.assign(reading="share of"),
            f"Section 2.4, {RECORDING}, scene 0: share of outliers in the frames that were "
            "compared online; where an occlusion is declared there is a gap; a line that is "
            "missing is one of features by which it is declared in all frames but few",
            "outliers",
            2.8,
            ("γ", GAMMA),
        )

    def _series(self, value_of: Callable[[Run], Values]) -> pd.DataFrame:
        """A number over frames, a column a preset."""
        pieces = [
            pd.DataFrame({"value": value_of(run), "label": label, "repetition": 0, "scene": words})
            for words, runs in self.runs.items()
            for label, run in runs.items()
        ]
        return pd.concat([piece.assign(frame=piece.index) for piece in pieces] or [pd.DataFrame()])

    def _over_frames(
        self,
        series: pd.DataFrame,
        title: str,
        quantity: str,
        row_height: float,
        level: tuple[str, float] | None = None,
    ) -> Figure | None:
        if not self.runs:
            return None
        shades = {
            "lamp off": self.truth.attributes["lamp off"],
            "half hidden or more": self.truth.visibility < HIDDEN,
        }
        return series_grid(
            series,
            title,
            quantity,
            list(FEATURES),
            {},
            row_height=row_height,
            shades=dict.fromkeys(self.runs, shades),
            level=level,
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


def loss_plot(scores: pd.DataFrame) -> Figure | None:
    """Share of the scenes in which the target was never lost up to a frame; None without runs."""
    chosen = scores[(scores["sequence"] == RECORDING) & (scores["variant"] == "")]
    chosen = chosen.dropna(subset=["first_loss"])
    pieces = []
    for words, preset in PRESETS.items():
        for trace in ("revised", "online"):
            runs = chosen[(chosen["preset"] == preset) & (chosen["trace"] == trace)]
            for features, rows in runs.groupby(_features(runs), sort=False):
                frames = np.arange(int(rows["frames"].max()))
                kept = rows["first_loss"].to_numpy()[:, np.newaxis] > frames
                labels = {"label": CALLED[str(features)], "reading": trace, "scene": words}
                series = {"frame": frames, "value": kept.mean(axis=0), "repetition": 0}
                pieces.append(pd.DataFrame(series).assign(**labels))
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


def _features(scores: pd.DataFrame) -> "pd.Series[str]":
    """By the tracker's names: in scores arc tangents are a definition of the invariants."""
    return scores["features"].mask(scores["definition"] == "arctan", "arctan")


def sign_plot(tables: Mapping[str, pd.DataFrame]) -> Figure | None:
    """Share of outliers as a sign of an occlusion, by threshold; None where it was not measured."""
    if "ng-15" not in tables:
        return None
    return roc_plot(
        pd.concat(
            roc_points(rows).assign(label=CALLED[str(features)])
            for features, rows in tables["ng-15"].groupby("features", sort=False)
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
