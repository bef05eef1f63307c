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
from bench.papers.context import Context
from bench.papers.nummiaro2003.measures import GONE, HIDDEN
from bench.papers.nummiaro2003.short_runs import begun_empty
from bench.papers.runs import over_frames
from datasets import Sequence
from reports.samples import Placed, Surface, Track, placement_plot, surface_plot, trajectory_plot
from reports.series import appearance_plot, series_plot

__all__ = ["appearances", "entrance", "surface", "times", "trajectories"]

Tables: TypeAlias = Mapping[str, pd.DataFrame]

PERSON, CAR, STUDENTS = (f"nummiaro2003/{name}" for name in ("person", "car", "students"))
PRESET = "as-written"
WRITTEN = f"nummiaro2003:preset={PRESET}"

EVERY = 25  # frames of Fig. 4


def appearances(context: Context) -> dict[str, Figure | None]:
    """Fig. 7, with update of the model and without."""
    return {
        "figure-7": _appearances(context, WRITTEN, "with update"),
        "figure-7-without-update": _appearances(
            context, f"{WRITTEN}:model_update=false", "without update"
        ),
    }


def _appearances(context: Context, tracker: str, label: str) -> Figure | None:
    runs = context.stored.of("nummiaro2003-figure-6", STUDENTS, tracker)
    if not runs:
        return None
    truth = context.stored.truth("nummiaro2003-figure-6", runs[0])
    parameters = runs[0].identity.parameters
    visible = np.where(np.isfinite(truth.boxes).all(axis=1), truth.visibility, 0.0)
    return appearance_plot(
        over_frames({"": runs}, "positive_appearances", "mode"),
        f"Fig. 7, as written, {STUDENTS}, {label}: samples that fulfil the appearance condition",
        parameters["kick_off"] * parameters["particles"],
        {"hidden by half": visible < HIDDEN, "hidden or gone": visible < GONE},
    )


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
        for run in stored.of("nummiaro2003-figure-4", name, WRITTEN)[:1]:
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
    times = context.tables.get("run_times", pd.DataFrame())
    if times.empty:
        return None
    series = times.assign(label=times["sequence"], value=1e3 * times["seconds"])
    labels = [name for name in (PERSON, CAR) if name in set(times["sequence"])]
    title = "Fig. 5, as written: time per frame, 100 samples, one thread, compiled"
    return series_plot(series, title, "CPU time [ms]", labels)


def _ellipses(rows: pd.DataFrame) -> NDArray[np.float64]:
    return rows[["x", "y", "half_width", "half_height"]].to_numpy(np.float64)


def _first(tables: Tables, name: str) -> pd.DataFrame | None:
    """Rows of the first scene with what is as written; None without any."""
    rows: pd.DataFrame = tables.get(name, pd.DataFrame())
    if rows.empty:
        return None
    rows = rows[rows["name"] == rows["name"].iloc[0]]
    return rows[rows["preset"] == PRESET] if "preset" in rows else rows
