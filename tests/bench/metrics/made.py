"""Made-up truths and answers of which tests of metrics presets know what they score."""

import numpy as np

from trackmark.bench.metrics.preset import FrameState, GroundTruthArrays, RunEstimates

SIZE = (320, 240)


def truth_of(boxes, **further):
    return GroundTruthArrays(np.asarray(boxes, float), **{"image_size": SIZE, **further})


def walk(n, seed=0):
    """Truth of a target that walks about inside the image and changes its size."""
    rng = np.random.default_rng(seed)
    place = 100 + np.cumsum(rng.normal(0, 2, (n, 2)), axis=0).clip(-90, 80)
    size = 30 + np.cumsum(rng.normal(0, 0.5, (n, 2)), axis=0).clip(-15, 15)
    return np.column_stack([place, size])


def noisy(truth, scale=4.0, seed=1):
    """Boxes as a tracker might give them, with positive sizes."""
    boxes = truth + np.random.default_rng(seed).normal(0, scale, truth.shape)
    boxes[:, 2:] = np.maximum(boxes[:, 2:], 1.0)
    return boxes


def states_of(n, failures=(), skip=5):
    """States of a supervised run of n frames that failed in some."""
    states = np.full(n, FrameState.TRACKED)
    states[:1] = FrameState.INITIALISED
    for frame in failures:
        states[frame] = FrameState.FAILED
        states[frame + 1 : frame + skip] = FrameState.SKIPPED
        states[frame + skip : frame + skip + 1] = FrameState.INITIALISED
    return states


def answer_of(boxes, **further):
    """An answer that every preset takes."""
    boxes = np.asarray(boxes, float)
    return RunEstimates(boxes, **{"states": states_of(len(boxes)), **further})
