"""Numbers over frames, medians over scenes, and numbers against the number of particles."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.claims.ledger import ANY
from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error
from bench.papers.stored import StoredRuns
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS
from bench.papers.wang2010.methods import EXPERIMENTS, PRESETS, compared
from bench.papers.wang2010.scores import FILTER, PROPOSED, RULE, TEN, by_number
from bench.statistics.intervals import wilson_interval
from bench.store.truth import StoredTruth
from reports.curves import curve_plot
from reports.series import series_grid

__all__ = ["error_plots", "particle_plot", "sample_size_plot", "time_plot"]

ERRORS = {"figure-4": TABLE_TENNIS, "figure-5-errors": HAND, "figure-6-errors": CUP}
"""By name: whose centre error is drawn."""

FILTERS = ("proposed", "particle filter")

SETTINGS = {
    "as written, σ = 1": ("as-written", ""),
    "recommended, σ = 0.158": ("recommended", ""),
    "σ = 0.2 (post hoc)": ("as-written", "sigma=0.2"),
}
"""Preset and variant of the panels on the number of particles."""

NUMBERED = {
    "proposed": (PROPOSED, RULE, ANY),
    "proposed, r = 10": (PROPOSED, TEN, ANY),
    "particle filter": (FILTER, RULE, RULE),
    "particle filter, r = 10": (FILTER, TEN, RULE),
    "particle filter, r = 3.87": (FILTER, RULE, "3.87"),
}
"""Tracker, `radius` and `reach` of their lines."""

PAPERS_NUMBERS = (60.0, 400.0)

OverFrames = Callable[[Run, StoredTruth], NDArray[np.float64]]


def error_plots(stored: StoredRuns) -> dict[str, Figure]:
    """Fig. 4, and the same of the other sequences, by name; none where there is no run."""
    plots = {}
    for name, sequence in ERRORS.items():
        labels = list(compared(sequence, "as written"))
        presets = ["as written"] if sequence == HAND else list(PRESETS)
        pieces = [
            over_scenes(stored, sequence, compared(sequence, preset), _error).assign(scene=preset)
            for preset in presets
        ]
        series = _joined(pieces)
        if series is not None:
            number = name.split("-")[1]
            plots[name] = series_grid(
                series.assign(reading=f"{series['repetition'].nunique()} scenes"),
                f"Fig. {number}, {sequence}: centre error, means over repetitions; frames count "
                "from 1",
                "error [px]",
                labels,
                {},
                "scenes",
                2.8,
            )
    return plots


def sample_size_plot(stored: StoredRuns) -> Figure | None:
    """Effective sample size of both filters on every sequence; None without runs."""
    pieces = []
    for sequence in EXPERIMENTS:
        number = ":particles=15" if sequence == CUP else ""
        for preset, chosen in PRESETS.items():
            trackers = {
                "proposed": f"wang2010:{chosen}{number}",
                "particle filter": f"particle-filter:{chosen}",
            }
            rows = over_scenes(stored, sequence, trackers, _sample_size)
            pieces.append(rows.assign(reading=preset, scene=sequence.partition("/")[2]))
    series = _joined(pieces)
    if series is None:
        return None
    title = (
        "Effective sample size over N, means over repetitions (1: all weights are equal, and the "
        "observation tells nothing); frames count from 1"
    )
    return series_grid(series, title, "ESS / N", FILTERS, {}, "scenes", 2.0)


def over_scenes(
    stored: StoredRuns, name: str, trackers: Mapping[str, str], value_of: OverFrames
) -> pd.DataFrame:
    """A number over frames of the runs on all scenes of a sequence, which an experiment has.

    Parameters
    ----------
    stored : StoredRuns
    name : str
        The sequence, without variant.
    trackers : mapping of str to str
        Text forms by label.
    value_of : callable
        Number by frame of a run, from it and its truth.

    Returns
    -------
    DataFrame
        `label`, `repetition` (the scene's place among the sequences), `frame` (from 1), `value`
        (mean over the repetitions).
    """
    experiment = EXPERIMENTS[name]
    pieces = [pd.DataFrame(columns=["label", "repetition", "frame", "value"])]
    for label, tracker in trackers.items():
        for scene, text in enumerate(stored.sequences(experiment)):
            runs = stored.of(experiment, text, tracker)
            if runs:
                truth = stored.truth(experiment, runs[0])
                values = np.mean([value_of(run, truth) for run in runs], axis=0)
                rows = {"label": label, "repetition": scene, "value": values}
                pieces.append(pd.DataFrame(rows).assign(frame=np.arange(1, len(values) + 1)))
    return pd.concat(pieces[1:] or pieces, ignore_index=True)


def _joined(pieces: list[pd.DataFrame]) -> pd.DataFrame | None:
    """All rows; None for none. Columns of an empty piece have no type, and would take others'."""
    found = [piece for piece in pieces if len(piece)]
    return pd.concat(found, ignore_index=True) if found else None


def _error(run: Run, truth: StoredTruth) -> NDArray[np.float64]:
    return centre_error(truth.boxes, run.boxes)


def _sample_size(run: Run, truth: StoredTruth) -> NDArray[np.float64]:
    return run.details["effective_sample_size"]


def particle_plot(scores: pd.DataFrame) -> Figure | None:
    """Share of the runs that succeed, against the number of particles; None without runs.

    Parameters
    ----------
    scores : DataFrame
        See `scores.tidy_scores`.
    """
    rows = by_number(scores)
    points = [
        {"panel": panel, "label": label, "setting": number, **_share(runs)}
        for panel, (preset, variant) in SETTINGS.items()
        for label, (tracker, radius, reach) in NUMBERED.items()
        for number, runs in rows[
            (rows["tracker"] == tracker)
            & (rows["radius"] == radius)
            & (rows["reach"] == reach)
            & (rows["preset"] == preset)
            & (rows["variant"] == variant)
        ].groupby("particles")
    ]
    if not points:
        return None
    return curve_plot(
        pd.DataFrame(points),
        "Section 3.1: runs that succeed on the ball, by the number of particles (paper: 60 and 400 "
        "are needed)",
        "particles",
        "share of the runs",
        list(NUMBERED),
        heading="95 % intervals, as if a scene were one trial",
        marks=PAPERS_NUMBERS,
    )


def _share(runs: pd.DataFrame) -> dict[str, float]:
    shares = runs.groupby("scene")["success"].mean()
    value = float(shares.mean())
    interval = wilson_interval(value, len(shares))
    return {"value": value, "low": interval.low, "high": interval.high}


def time_plot(times: pd.DataFrame) -> Figure | None:
    """Time a frame against the number of particles; None without times.

    Parameters
    ----------
    times : DataFrame
        `particle_times` of `timing.measured_times`.
    """
    if times.empty:
        return None
    milliseconds = times.assign(value=1e3 * times["seconds"])
    found = milliseconds.groupby(["implementation", "method", "particles"], sort=False)["value"]
    points = found.agg(value="median", low="min", high="max").reset_index()
    columns = {"implementation": "panel", "method": "label", "particles": "setting"}
    return curve_plot(
        points.rename(columns=columns).replace({"label": {"particle_filter": "particle filter"}}),
        f"CPU time a frame by the number of particles, on {TABLE_TENNIS}",
        "particles",
        "time [ms]",
        list(FILTERS),
        heading="medians and ranges over passes",
        marks=PAPERS_NUMBERS,
        logarithmic=True,
    )
