"""Fig. 2, 4 and 7: surface of ρ, trajectories, and samples that meet the appearance condition."""

import numpy as np
from matplotlib.figure import Figure

from trackmark import datasets
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.nummiaro2003.measures import GONE, HIDDEN
from trackmark.bench.papers.nummiaro2003.sample_plots import (
    Track,
    appearance_plot,
    surface_plot,
    trajectory_plot,
)
from trackmark.bench.papers.nummiaro2003.scenes import surfaces
from trackmark.bench.papers.runs import Context

EVERY = 25  # distance of the ellipses in Fig. 4 [frames]


def surface(context: Context) -> dict[str, Figure]:
    """Draw Fig. 2 in both settings: samples, mean state, and ρ around the target."""
    scene = context.paper.first_scene("person")
    figures = {}
    for setting in SETTINGS:
        last = surfaces(scene, context.paper.spec("no model update", setting), 1)[-1]
        title = (
            f"Fig. 2, {setting}, {scene}, frame {last.frame}: samples (black), their mean (white), "
            "and the Bhattacharyya coefficient around the target"
        )
        figures[f"figure-2-{setting}"] = surface_plot(last, title)
    return figures


def trajectories(context: Context) -> dict[str, Figure]:
    """Draw Fig. 4 in both settings: the trajectory of the mean state on the first scene."""
    figures = {}
    for setting in SETTINGS:
        spec = context.paper.spec("adaptive", setting)
        tracks = []
        for sequence in ("person", "car"):
            scene = context.paper.first_scene(sequence)
            if measured := context.runs.measured_run(spec, scene):
                last = int(np.flatnonzero(measured.present)[-1])
                image = datasets.load(scene)[last]
                tracks.append(Track(image, scene, measured.boxes, measured.truth.boxes))
        title = (
            f"Fig. 4, {setting}: path of the mean state, its ellipse every {EVERY} frames, and "
            "path of the target (dashed)"
        )
        if tracks:
            figures[f"figure-4-{setting}"] = trajectory_plot(tracks, title, EVERY)
    return figures


def appearances(context: Context) -> dict[str, Figure]:
    """Draw Fig. 7 in both settings: number of positive samples by frame on the first scene."""
    scene = context.paper.first_scene("students")
    figures = {}
    for setting in SETTINGS:
        spec = context.paper.spec("no model update", setting)
        measured = context.runs.measured_run(spec, scene)
        if not measured:
            continue
        parameters = measured.record.identity.parameters
        visible = np.where(measured.present, measured.truth.visibility, 0.0)
        figures[f"figure-7-{setting}"] = appearance_plot(
            measured.detail("positive_appearances"),
            measured.detail("mode"),
            f"Fig. 7, {setting}, {scene}: samples that fulfil the appearance condition",
            float(parameters["kick_off"]) * float(parameters["particles"]),
            {"hidden by half": visible < HIDDEN, "hidden or gone": visible < GONE},
        )
    return figures
