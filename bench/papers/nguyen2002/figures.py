"""Fig. 1: frames before, during and after an occlusion, and after a lamp is switched off."""

import numpy as np

from trackmark.bench.papers.cases import PaperTracker
from trackmark.bench.papers.figures import Runs, draw_strip, median_scene, runs_by_setting
from trackmark.bench.papers.nguyen2002.events import hidden_in
from trackmark.bench.papers.nguyen2002.measures import SWITCH
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.strips import Note, Strip
from trackmark.bench.store.truth import StoredTruth

BEFORE, AFTER = 3, 10  # frames before and after an occlusion; frames after the switch of a lamp
FEATURES = ("c1c2c3", "intensity", "RGB")


def strip(context: Context) -> Strip | None:
    """Draw frames of a scene, one row per kind of features, with the revised boxes."""
    trackers = [context.paper.trackers[features] for features in FEATURES]
    scene = median_scene(trackers[0], context.paper.sequences["lights"], context)
    if not scene:
        return None
    runs = runs_by_setting(trackers[0], scene, context)
    frames = shown_frames(next(iter(runs.values())).truth)
    columns = {frame: f"{frame} {label}" for frame, label in frames.items()}
    return draw_strip(scene, trackers, columns, _overlaps, context)


def _overlaps(_tracker: PaperTracker, runs: Runs, frame: int) -> list[Note]:
    return [Note(label, f"overlap {run.overlap[frame]:.2f}") for label, run in runs.items()]


def shown_frames(truth: StoredTruth) -> dict[int, str]:
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
