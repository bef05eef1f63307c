"""The paper's Fig. 1: a complete occlusion, and lamps switched, with the boxes of all features."""

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run, Trace
from bench.papers.nguyen2002.events import hidden_in
from bench.papers.stored import StoredRuns
from bench.store.truth import StoredTruth
from reports.film_strip import film_strip
from reports.overlay import TRUTH

__all__ = ["EXPERIMENT", "FEATURES", "PRESETS", "RECORDING", "film_strips", "runs_by_features"]

EXPERIMENT = "nguyen2002-figure-1"
RECORDING = "nguyen2002/lights"
FEATURES = {
    "intensity": "intensity",
    "RGB": "rgb",
    "c1c2c3": "invariants",
    "arctan of c1c2c3": "arctan",
}
"""By what they are called."""

PRESETS = {"as written": "as-written", "recommended": "recommended"}
TRACES: dict[str, Trace] = {"said at once (online)": "online", "in the end (revised)": "revised"}

NAMES = {"as written": "figure-1", "recommended": "figure-1-recommended"}
PAPERS = "c1c2c3"
BEFORE, AFTER = 3, 10  # frames from an occlusion, and from the switching of a lamp

Strip = NDArray[np.uint8]


def film_strips(stored: StoredRuns) -> dict[str, Strip]:
    """Strips of the first scene, by name; none where there is no run."""
    strips = {}
    for words, name in NAMES.items():
        runs = runs_by_features(stored, words)
        if runs:
            strips[name] = _strip(stored, runs, words)
    return strips


def runs_by_features(stored: StoredRuns, words: str) -> dict[str, Run]:
    """Runs on the first scene under a preset of `PRESETS`, by what their features are called."""
    return {
        label: found[0]
        for label, features in FEATURES.items()
        if (
            found := stored.of(
                EXPERIMENT, RECORDING, f"nguyen2002:preset={PRESETS[words]}:features={features}"
            )
        )
    }


def _strip(stored: StoredRuns, runs: dict[str, Run], words: str) -> Strip:
    """A row of frames for each kind of features, the paper's figure first."""
    sequence = datasets.load(RECORDING)
    truth = stored.truth(EXPERIMENT, next(iter(runs.values())))
    frames = chosen_frames(truth)
    return np.vstack(
        [
            film_strip(
                sequence.__getitem__,
                list(frames),
                {TRUTH: truth.boxes}
                | {said: run.boxes_in(trace) for said, trace in TRACES.items()},
                f"Fig. 1, {label}, {words}, {RECORDING}, scene 0",
                len(frames),
                words=frames,
            )
            for label, run in sorted(runs.items(), key=lambda one: one[0] != PAPERS)
        ]
    )


def chosen_frames(truth: StoredTruth) -> dict[int, str]:
    """Frames of Fig. 1 and what they show: a to c of an occlusion, d of a lamp; and one more."""
    frames: dict[int, str] = {}
    last = len(truth.boxes) - 1
    for occlusion in hidden_in(truth.visibility)[:1]:
        frames |= {
            max(0, occlusion.first - BEFORE): "a) before",
            (occlusion.first + occlusion.last) // 2: "b) hidden",
            min(last, occlusion.last + AFTER): "c) after",
        }
    lamp = truth.attributes["lamp off"]
    for frame in (np.flatnonzero(lamp[1:] != lamp[:-1]) + 1).tolist():
        words = "d) lamp off" if lamp[frame] else "lamp on again"
        frames[min(last, frame + AFTER)] = words
    return dict(sorted(frames.items()))
