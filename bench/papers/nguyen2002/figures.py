"""Fig. 1: frames before, during and after an occlusion, and after a lamp is switched off."""

import numpy as np

from trackmark import datasets
from trackmark.bench.papers.cases import Case
from trackmark.bench.papers.figures import median_scene, runs_by_setting
from trackmark.bench.papers.nguyen2002.events import hidden_in
from trackmark.bench.papers.nguyen2002.measures import SWITCH
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.strips import Note, Strip, StripRow
from trackmark.bench.store.truth import StoredTruth

BEFORE, AFTER = 3, 10  # frames before and after an occlusion; frames after the switch of a lamp
FEATURES = ("c1c2c3", "intensity", "RGB")


def strip(context: Context) -> Strip | None:
    """Draw frames of a scene, one row per kind of features, with the revised boxes."""
    paper = context.paper
    spec, sequence = paper.spec(FEATURES[0], "recommended"), paper.sequences["lights"]
    scene = median_scene(Case(spec, sequence, context.n_scenes), context)
    if not scene:
        return None
    images, rows = datasets.load(scene), list[StripRow]()
    frames, truth = dict[int, str](), np.empty((0, 4))
    for features in FEATURES:
        runs = runs_by_setting(paper.trackers[features], scene, context)
        truth = next(iter(runs.values())).truth.boxes
        frames = shown_frames(next(iter(runs.values())).truth)
        boxes = [{label: run.boxes[frame] for label, run in runs.items()} for frame in frames]
        notes = [
            [Note(label, f"overlap {run.overlap[frame]:.2f}") for label, run in runs.items()]
            for frame in frames
        ]
        rows.append(StripRow(features, [images[frame] for frame in frames], boxes, notes))
    selection = f"`{scene}`, which has the median error of {FEATURES[0]}, recommended"
    labels = [f"{frame} {label}" for frame, label in frames.items()]
    return Strip(selection, labels, [truth[frame] for frame in frames], rows)


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
