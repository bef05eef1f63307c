"""Fig. 1: frames before, during and after an occlusion, and after a lamp is switched off."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.nguyen2002.events import hidden_in
from trackmark.bench.papers.nguyen2002.measures import SWITCH
from trackmark.bench.papers.runs import Context
from trackmark.bench.store.truth import StoredTruth
from trackmark.reports.overlay import TRUTH, film_strip

BEFORE, AFTER = 3, 10  # frames before and after an occlusion; frames after the switch of a lamp
FEATURES = ("c1c2c3", "intensity", "RGB")


def strips(context: Context) -> NDArray[np.uint8] | None:
    """Draw frames of the first scene, one row per kind of features and setting."""
    scene = context.paper.first_scene("lights")
    image_of = cache(datasets.load(scene).__getitem__)  # all rows show the same frames
    rows = []
    for features in FEATURES:
        for setting in SETTINGS:
            spec = context.paper.spec(features, setting)
            for measured in context.runs.measured_runs(spec, scene)[:1]:
                frames = chosen_frames(measured.truth)
                boxes = {TRUTH: measured.truth.boxes}
                boxes |= {
                    name: measured.in_trajectory(name).boxes for name in ("online", "revised")
                }
                title = f"Fig. 1, {features}, {setting.replace('-', ' ')}"
                rows.append(
                    film_strip(image_of, list(frames), boxes, title, len(frames), remarks=frames)
                )
    return np.vstack(rows) if rows else None


def chosen_frames(truth: StoredTruth) -> dict[int, str]:
    """Return the frames of Fig. 1 with their labels: a to c an occlusion, d a lamp."""
    frames: dict[int, str] = {}
    last = len(truth.boxes) - 1
    for occlusion in hidden_in(truth.visibility)[:1]:
        frames |= {
            max(0, occlusion.first - BEFORE): "a) before",
            (occlusion.first + occlusion.last) // 2: "b) hidden",
            min(last, occlusion.last + AFTER): "c) after",
        }
    lamp = truth.attributes[SWITCH]
    for frame in (np.flatnonzero(lamp[1:] != lamp[:-1]) + 1).tolist():
        label = "d) lamp off" if lamp[frame] else "lamp on again"
        frames[min(last, frame + AFTER)] = label
    return dict(sorted(frames.items()))
