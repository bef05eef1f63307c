"""Fig. 2, 4 and 7: the surface of ρ, trajectories, and samples that look like the target."""

import numpy as np
from matplotlib.figure import Figure

from trackmark import datasets
from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.papers.context import Context
from trackmark.bench.papers.nummiaro2003.measures import GONE, HIDDEN
from trackmark.bench.papers.nummiaro2003.sample_plots import (
    Surface,
    Track,
    appearance_plot,
    surface_plot,
    trajectory_plot,
)
from trackmark.bench.papers.nummiaro2003.scenes import surfaces
from trackmark.bench.papers.plan import scene_names, tracker_text

EVERY = 25  # frames of Fig. 4


def surface(context: Context) -> dict[str, Figure]:
    """Draw Fig. 2 in both settings: samples, their mean, and ρ around the target."""
    ((scene,),) = scene_names(context.description, "person", 1)
    found = {}
    for setting in SETTINGS:
        one = surfaces(scene, setting, 1)[-1]
        left, top = one.places.min(axis=0)
        columns = len(np.unique(one.places[:, 0]))
        values = Surface(left, top, one.coefficients.reshape(-1, columns), "coefficient ρ")
        title = (
            f"Fig. 2, {setting}, {scene}, frame {one.frame}: samples (black), their mean (white), "
            "and the Bhattacharyya coefficient around the target"
        )
        found[f"figure-2-{setting}"] = surface_plot(one.image, one.samples, one.mean, values, title)
    return found


def trajectories(context: Context) -> dict[str, Figure]:
    """Draw Fig. 4 in both settings: the way of the mean state on the first scene."""
    found = {}
    for setting in SETTINGS:
        text = tracker_text(context.description, "adaptive", setting)
        tracks = []
        for sequence in ("person", "car"):
            ((scene,),) = scene_names(context.description, sequence, 1)
            for course in context.runs.courses(text, scene)[:1]:
                last = int(np.flatnonzero(course.present)[-1])
                image = datasets.load(scene)[last]
                tracks.append(Track(image, scene, course.boxes, course.truth.boxes))
        title = (
            f"Fig. 4, {setting}: the mean state's way, its ellipse every {EVERY} frames, and the "
            "target's way (dashed)"
        )
        if tracks:
            found[f"figure-4-{setting}"] = trajectory_plot(tracks, title, EVERY)
    return found


def appearances(context: Context) -> dict[str, Figure]:
    """Draw Fig. 7 in both settings: positive samples by frame on the first scene."""
    ((scene,),) = scene_names(context.description, "students", 1)
    found = {}
    for setting in SETTINGS:
        text = tracker_text(context.description, "no model update", setting)
        courses = context.runs.courses(text, scene)
        if not courses:
            continue
        parameters = courses[0].run.identity.parameters
        visible = np.where(courses[0].present, courses[0].truth.visibility, 0.0)
        found[f"figure-7-{setting}"] = appearance_plot(
            np.stack([course.detail("positive_appearances") for course in courses]),
            np.stack([course.detail("mode") for course in courses]),
            f"Fig. 7, {setting}, {scene}: samples that fulfil the appearance condition",
            float(parameters["kick_off"]) * float(parameters["particles"]),
            {"hidden by half": visible < HIDDEN, "hidden or gone": visible < GONE},
        )
    return found
