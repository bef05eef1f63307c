"""The paper's Fig. 2 to 10, of the first scene in even light, with what is as written.

Those that have one run show the first repetition, the others median and quartiles over all.
"""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.papers.context import Context
from bench.papers.nummiaro2003.courses import GONE, HIDDEN
from bench.papers.nummiaro2003.particles import begun_empty
from bench.papers.runs import StoredRuns, over_frames
from datasets import Sequence
from datasets.text_form import format_text
from reports.samples import Placed, Surface, Track, placement_plot, surface_plot, trajectory_plot
from reports.series import appearance_plot, series_grid, series_plot

__all__ = [
    "READINGS",
    "appearances",
    "by_update",
    "entrance",
    "half_axes",
    "scale_grid",
    "surface",
    "times",
    "trajectories",
]

Tables: TypeAlias = Mapping[str, pd.DataFrame]

PERSON, CAR, STUDENTS, TRAFFIC = (
    f"nummiaro2003/{name}" for name in ("person", "car", "students", "traffic")
)
PRESET = "as-written"
UPDATE = {"without update": False, "with update": True}

EVERY = 25  # frames of Fig. 4
_APART = {"axes": "apart", "scale_change": "multiplicative", "size_noise": 0.02}
_DYNAMICS: Mapping[str, Mapping[str, object]] = {
    "apart, damped": {**_APART, "scale_persistence": 0.9, "scale_noise": 0.008},
    "apart": _APART,
    "together, factors": {"scale_change": "multiplicative"},
    "linear": {},
}
READINGS: Mapping[str, Mapping[str, object]] = {
    f"{words}, σ {sigma}": {"update_reading": "coefficient", "sigma": sigma, **parameters}
    for words, parameters in _DYNAMICS.items()
    for sigma in (0.1, 0.05)
}
"""Those of the experiment on Fig. 9 that have the printed weights."""


def half_axes(context: Context) -> dict[str, Figure | None]:
    """Fig. 9, over several scenes, and over readings."""
    presets = {"as written": {}, "recommended": {"preset": "recommended"}}
    over_readings = "Fig. 9 over readings of the dynamics and of σ (update where ρ > 0.9; post hoc)"
    stored, scenes = context.stored, (8, 9, 10, 11)
    return {
        "figure-9": _half_width(stored),
        "figure-9-scenes": scale_grid(
            stored, "figure-8", presets, (0, 1, 2, 3), "Fig. 9 on several scenes"
        ),
        "figure-9-readings": scale_grid(stored, "figure-9", READINGS, scenes, over_readings),
    }


def appearances(context: Context) -> dict[str, Figure | None]:
    """Fig. 7, with update of the model and without."""
    return {
        "figure-7": _appearances(context.stored, update=True),
        "figure-7-without-update": _appearances(context.stored, update=False),
    }


def by_update(
    stored: StoredRuns, figure: str, sequence: str, **parameters: object
) -> dict[str, list[Run]]:
    """Runs without and with update of the model, by label.

    Parameters
    ----------
    stored : StoredRuns
        Where they are.
    figure : str
        Whose experiment.
    sequence : str
        Canonical name.
    **parameters
        Of the tracker, beside those of the preset `as-written` unless another is given.
    """
    return {
        label: stored.of(
            f"nummiaro2003-{figure}",
            sequence,
            format_text("nummiaro2003", {"preset": PRESET} | parameters | {"model_update": update}),
        )
        for label, update in UPDATE.items()
    }


def scale_grid(
    stored: StoredRuns,
    figure: str,
    readings: Mapping[str, Mapping[str, object]],
    scenes: tuple[int, ...],
    title: str,
) -> Figure | None:
    """Hx of the mean state with and without update: a row a reading, a column a scene."""
    pieces, truths = [], {}
    for reading, parameters in readings.items():
        for scene in scenes:
            sequence = format_text(TRAFFIC, {"scene": scene} if scene else {})
            found = _half_widths(stored, figure, sequence, **parameters)
            if found is not None:
                series, truths[f"scene {scene}"] = found
                pieces.append(series.assign(reading=reading, scene=f"scene {scene}"))
    if not pieces:
        return None
    every = pd.concat(pieces, ignore_index=True)
    return series_grid(every, title, "Hx [px]", list(UPDATE), truths)


def surface(context: Context) -> Figure | None:
    """Fig. 2."""
    tables = context.tables
    values, particles = (_first(tables, name) for name in ("surface", "surface_particles"))
    if values is None or particles is None:
        return None
    name, frame = values["name"].iloc[0], int(values["frame"].iloc[0])
    grid = values.pivot_table("coefficient", "y", "x").sort_index(axis=1)
    ellipses = {str(kind): _ellipses(rows) for kind, rows in particles.groupby("kind")}
    return surface_plot(
        datasets.load(name)[frame],
        ellipses["particle"],
        ellipses["mean"][0],
        Surface(values["x"].min(), values["y"].min(), grid.to_numpy(), "coefficient ρ"),
        f"Fig. 2, as written, {name}, frame {frame}: samples (black), their mean (white), and the "
        "Bhattacharyya coefficient around the target",
    )


def entrance(context: Context) -> Figure | None:
    """Fig. 3."""
    particles, regions = (
        _first(context.tables, name) for name in ("entrance_particles", "entrance_regions")
    )
    if particles is None or regions is None:
        return None
    sequence = begun_empty(particles["name"].iloc[0])
    tracks = particles["tracking"] == 1
    frames = [(particles[~tracks]["frame"].min(), "samples wait")]
    found = (particles[tracks]["frame"].min(), "tracking")
    frames.append(found if tracks.any() else (particles["frame"].max(), "not found yet"))
    panels = [
        _placed(sequence, particles[particles["frame"] == frame], int(frame), words, regions)
        for frame, words in frames
        if np.isfinite(frame)
    ]
    title = (
        f"Fig. 3, as written, {sequence.name}: samples at doors and borders, and the target found"
    )
    return placement_plot(panels, title)


def _placed(
    sequence: Sequence, particles: pd.DataFrame, frame: int, words: str, regions: pd.DataFrame
) -> Placed:
    ellipses, told = _ellipses(particles), f"frame {frame}: {words}"
    if particles["tracking"].iloc[0]:
        return Placed(sequence[frame], told, ellipses, particles["weight"].to_numpy() @ ellipses)
    boxes = regions[["x", "y", "width", "height"]].to_numpy(np.float64)
    return Placed(sequence[frame], told, ellipses, regions=boxes)


def trajectories(context: Context) -> Figure | None:
    """Fig. 4."""
    stored = context.stored
    tracks = []
    for name in (PERSON, CAR):
        for run in by_update(stored, "figure-4", name)["with update"][:1]:
            truth = stored.truth("nummiaro2003-figure-4", run).boxes
            last = int(np.flatnonzero(np.isfinite(truth).all(axis=1))[-1])
            tracks.append(Track(datasets.load(name)[last], name, run.boxes, truth))
    if not tracks:
        return None
    title = (
        "Fig. 4, as written, first repetition: the mean state's way, its ellipse every "
        f"{EVERY} frames, and the target's way (dashed)"
    )
    return trajectory_plot(tracks, title, EVERY)


def times(context: Context) -> Figure | None:
    """Fig. 5."""
    times = context.tables["run_times"]
    if times.empty:
        return None
    series = times.assign(label=times["sequence"], value=1e3 * times["seconds"])
    labels = [name for name in (PERSON, CAR) if name in set(times["sequence"])]
    title = "Fig. 5, as written: time per frame, 100 samples, one thread, compiled"
    return series_plot(series, title, "CPU time [ms]", labels)


def _appearances(stored: StoredRuns, *, update: bool) -> Figure | None:
    """Fig. 7."""
    label = "with update" if update else "without update"
    runs = by_update(stored, "figure-6", STUDENTS)[label]
    if not runs:
        return None
    truth = stored.truth("nummiaro2003-figure-6", runs[0])
    parameters = runs[0].identity.parameters
    visible = np.where(np.isfinite(truth.boxes).all(axis=1), truth.visibility, 0.0)
    return appearance_plot(
        over_frames({"": runs}, "positive_appearances", "mode"),
        f"Fig. 7, as written, {STUDENTS}, {label}: samples that fulfil the appearance condition",
        parameters["kick_off"] * parameters["particles"],
        {"hidden by half": visible < HIDDEN, "hidden or gone": visible < GONE},
    )


def _half_width(stored: StoredRuns) -> Figure | None:
    """Fig. 9."""
    found = _half_widths(stored, "figure-8", TRAFFIC)
    if found is None:
        return None
    title = f"Fig. 9, as written, {TRAFFIC}: the half axis Hx of the mean state"
    return series_plot(found[0], title, "Hx [px]", list(UPDATE), found[1])


def _half_widths(
    stored: StoredRuns, figure: str, sequence: str, **parameters: object
) -> tuple[pd.DataFrame, NDArray[np.float64]] | None:
    """Hx of the mean state over frames, and of the truth; None without runs."""
    runs = by_update(stored, figure, sequence, **parameters)
    every = [run for repetitions in runs.values() for run in repetitions]
    if not every:
        return None
    truth = stored.truth(f"nummiaro2003-{figure}", every[0]).boxes[:, 2] / 2
    return over_frames(runs, "half_width").rename(columns={"half_width": "value"}), truth


def _ellipses(rows: pd.DataFrame) -> NDArray[np.float64]:
    return rows[["x", "y", "half_width", "half_height"]].to_numpy(np.float64)


def _first(tables: Tables, name: str) -> pd.DataFrame | None:
    """Rows of the first scene with what is as written; None without any."""
    rows: pd.DataFrame = tables.get(name, pd.DataFrame())
    if rows.empty:
        return None
    rows = rows[rows["name"] == rows["name"].iloc[0]]
    return rows[rows["preset"] == PRESET] if "preset" in rows else rows
