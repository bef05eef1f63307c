"""Scores of the paper's trackers, and runs of which every J is known."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bench.evaluation.record import Run
from bench.metrics.regions import Segmentation
from bench.papers.moreno2005.courses import JUMP, PATCH
from bench.papers.moreno2005.scores import labels_of
from bench.store.truth import StoredTruth

N = 40

WRITTEN, RECOMMENDED = "moreno2005:preset=as-written", "moreno2005"
BASELINES = [
    f"contour-smooth-color:preset={preset}:mixing={mixing}"
    for preset in ("as-written", "recommended")
    for mixing in (1, 0.5, 0.3)
]

ELLIPSES = [("moreno2005/ellipse", {"lighting": light}) for light in ("even", "jump", "repeated")]
BOOKS = [
    ("moreno2005/book", {"illuminant": illuminant, "shadow": shadow})
    for illuminant in ("changing", "constant")
    for shadow in ("self", "none")
]
LEAVES = [("moreno2005/leaf", {"jump": jump}) for jump in ("start", "middle")]
OCTOPUS = [("moreno2005/octopus", {})]


@pytest.fixture(scope="session")
def made_run():
    """Makes a run with these values of J by frame."""

    def make(similarity):
        values = np.asarray(similarity, float)
        return Run(
            identity=SimpleNamespace(parameters={}),
            boxes=np.zeros((len(values), 4)),
            visible=np.ones(len(values), bool),
            confidence=np.full(len(values), np.nan),
            segmentation=Segmentation(values, values),
        )

    return make


@pytest.fixture(scope="session")
def made_truth():
    """Makes a truth with jumps of the light, and similar patches, in these frames."""

    def make(n=N, jumps=(), patches=()):
        attributes = {}
        for name, frames in ((JUMP, jumps), (PATCH, patches)):
            attributes[name] = np.isin(np.arange(n), list(frames))
        return StoredTruth("made", np.zeros((n, 4)), {}, np.ones(n), attributes, 25.0)

    return make


@pytest.fixture(scope="session")
def made_scores():
    """Makes scores: `fares` gives what is known of a run beside the usual, from its labels."""

    def make(fares, texts=(WRITTEN, RECOMMENDED, *BASELINES), where=ELLIPSES, scenes=10, runs=3):
        rows = []
        for (sequence, knobs), text in product(where, texts):
            for scene, repetition in product(range(scenes), range(runs)):
                usual = (
                    {
                        "text": text,
                        "sequence": sequence,
                        "scene": scene,
                        "light": "even",
                        "lighting": "even",
                        "clutter": "",
                        "illuminant": "",
                        "shadow": "",
                        "jump": "",
                        "name": f"{sequence}:scene={scene}:{knobs}",
                        "repetition": repetition,
                        "frames": 100,
                        "success_frames": 100,
                        "frames_inside": 100,
                        "first_loss": 100.0,
                        "mean_overlap": 0.9,
                        "path": "",
                        "failure": "",
                        "kept_scene": True,
                        "mean_region_similarity": 0.9,
                        "mean_contour_accuracy": 0.8,
                        "tracked": 1.0,
                        "gone": 0.0,
                        "least_similarity": 0.7,
                        "lost_by_jump": 0.0,
                        "near_patch": 0.9,
                        "elsewhere": 0.9,
                        "set": "any",
                        "scale": "any",
                        "dependence": "any",
                    }
                    | labels_of(text)
                    | knobs
                )
                rows.append(usual | fares(SimpleNamespace(**usual)))
        return pd.DataFrame(rows)

    return make
