"""The paper's Fig. 2 to 10, of the first scene in even light, with what is as written.

Those that have one run show the first repetition, the others median and quartiles over all.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import datasets
from bench.papers import Asked
from bench.papers.drawing import write_pictures
from bench.papers.nummiaro2003.courses import GONE, HIDDEN
from bench.papers.nummiaro2003.grid import scale_grids
from bench.papers.nummiaro2003.stored import UPDATE, AdaptiveRuns
from bench.papers.nummiaro2003.strips import film_strips
from bench.papers.stored import over_frames
from datasets import Sequence
from reports.samples import Placed, Surface, Track, placement_plot, surface_plot, trajectory_plot
from reports.series import appearance_plot, series_plot

__all__ = ["NUMBERS", "draw"]

Tables = Mapping[str, pd.DataFrame]

PERSON, CAR, STUDENTS, TRAFFIC = (
    f"nummiaro2003/{name}" for name in ("person", "car", "students", "traffic")
)
PRESET = "as-written"
EVERY = 25  # frames of Fig. 4

NUMBERS = tuple(range(2, 11))


def draw(results: Path, folder: Path, asked: Asked, tables: Tables) -> list[Path]:
    """Draw all figures whose runs were asked for and are there.

    Parameters
    ----------
    results : Path
        Folder of all experiments.
    folder : Path
        Where to.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    tables : mapping of str to DataFrame
        Of what `checks` measures `surface`, `surface_particles`, `entrance_particles` and
        `entrance_regions`; of `timing.measured_times` `run_times`.
    """
    stored = AdaptiveRuns(results, asked)
    plots = {
        "figure-2": _surface(tables),
        "figure-3": _entrance(tables),
        "figure-4": _trajectories(stored),
        "figure-5": _times(tables),
        "figure-7": _appearances(stored, update=True),
        "figure-7-without-update": _appearances(stored, update=False),
        "figure-9": _half_width(stored),
        **scale_grids(stored),
    }
    return write_pictures(folder, plots, film_strips(stored))


def _surface(tables: Tables) -> Figure | None:
    """Fig. 2."""
    surface, particles = (_first(tables, name) for name in ("surface", "surface_particles"))
    if surface is None or particles is None:
        return None
    values = surface.pivot_table("coefficient", "y", "x").sort_index(axis=1)
    ellipses = {
        str(kind): rows[["x", "y", "half_width", "half_height"]].to_numpy(np.float64)
        for kind, rows in particles.groupby("kind")
    }
    name, frame = surface["name"].iloc[0], int(surface["frame"].iloc[0])
    return surface_plot(
        datasets.load(name)[frame],
        ellipses["particle"],
        ellipses["mean"][0],
        Surface(surface["x"].min(), surface["y"].min(), values.to_numpy(), "coefficient ρ"),
        f"Fig. 2, as written, {name}, frame {frame}: samples (black), their mean (white), and the "
        "Bhattacharyya coefficient around the target",
    )


def _entrance(tables: Tables) -> Figure | None:
    """Fig. 3."""
    particles, regions = (
        _first(tables, name) for name in ("entrance_particles", "entrance_regions")
    )
    if particles is None or regions is None:
        return None
    sequence = datasets.load(particles["name"].iloc[0])
    waiting = particles[particles["tracking"] == 0]
    frames = [(waiting["frame"].min(), "samples wait"), (particles["frame"].max(), "not found yet")]
    tracking = particles[particles["tracking"] == 1]
    if len(tracking):
        frames[1] = tracking["frame"].min(), "tracking"
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
    ellipses = particles[["x", "y", "half_width", "half_height"]].to_numpy(np.float64)
    if particles["tracking"].iloc[0]:
        mean = particles["weight"].to_numpy() @ ellipses
        return Placed(sequence[frame], f"frame {frame}: {words}", ellipses, mean)
    boxes = regions[["x", "y", "width", "height"]].to_numpy(np.float64)
    return Placed(sequence[frame], f"frame {frame}: {words}", ellipses, regions=boxes)


def _trajectories(stored: AdaptiveRuns) -> Figure | None:
    """Fig. 4."""
    experiment = "nummiaro2003-figure-4"
    tracks = []
    for name in (PERSON, CAR):
        for run in stored.written(experiment, name)[:1]:
            truth = stored.truth(experiment, run).boxes
            last = int(np.flatnonzero(np.isfinite(truth).all(axis=1))[-1])
            tracks.append(Track(datasets.load(name)[last], name, run.boxes, truth))
    if not tracks:
        return None
    title = (
        "Fig. 4, as written, first repetition: the mean state's way, its ellipse every "
        f"{EVERY} frames, and the target's way (dashed)"
    )
    return trajectory_plot(tracks, title, EVERY)


def _times(tables: Tables) -> Figure | None:
    """Fig. 5."""
    times = tables["run_times"]
    if times.empty:
        return None
    series = times.assign(label=times["sequence"], value=1e3 * times["seconds"])
    labels = [name for name in (PERSON, CAR) if name in set(times["sequence"])]
    title = "Fig. 5, as written: time per frame, 100 samples, one thread, compiled"
    return series_plot(series, title, "CPU time [ms]", labels)


def _appearances(stored: AdaptiveRuns, *, update: bool) -> Figure | None:
    """Fig. 7."""
    experiment = "nummiaro2003-figure-6"
    runs = stored.written(experiment, STUDENTS, model_update=update)
    if not runs:
        return None
    truth, parameters = stored.truth(experiment, runs[0]), runs[0].identity.parameters
    visible = np.where(np.isfinite(truth.boxes).all(axis=1), truth.visibility, 0.0)
    rows = over_frames({"": runs}, "positive_appearances", "mode")
    return appearance_plot(
        rows,
        f"Fig. 7, as written, {STUDENTS}, {'with' if update else 'without'} update: samples that "
        "fulfil the appearance condition",
        parameters["kick_off"] * parameters["particles"],
        {"hidden by half": visible < HIDDEN, "hidden or gone": visible < GONE},
    )


def _half_width(stored: AdaptiveRuns) -> Figure | None:
    """Fig. 9."""
    experiment = "nummiaro2003-figure-8"
    runs = stored.by_update(experiment, TRAFFIC)
    found = [run for repetitions in runs.values() for run in repetitions]
    if not found:
        return None
    series = over_frames(runs, "half_width").rename(columns={"half_width": "value"})
    truth = stored.truth(experiment, found[0]).boxes[:, 2] / 2
    title = f"Fig. 9, as written, {TRAFFIC}: the half axis Hx of the mean state"
    return series_plot(series, title, "Hx [px]", list(UPDATE), truth)


def _first(tables: Tables, name: str) -> pd.DataFrame | None:
    """Rows of the first scene with what is as written; None without any."""
    rows: pd.DataFrame = tables.get(name, pd.DataFrame())
    if rows.empty:
        return None
    rows = rows[rows["name"] == rows["name"].iloc[0]]
    if "preset" in rows:
        rows = rows[rows["preset"] == PRESET]
    return rows
