"""Artificial ground truth and estimates for tests of metrics."""

import numpy as np

from trackmark.bench.metrics.interface import FrameState, GroundTruthArrays, RunEstimates

SIZE = (320, 240)


def truth_of(boxes, **further):
    return GroundTruthArrays(np.asarray(boxes, float), **{"image_size": SIZE, **further})


def walk(n, seed=0):
    """Return ground truth of a target that moves inside the image and changes its size."""
    rng = np.random.default_rng(seed)
    place = 100 + np.cumsum(rng.normal(0, 2, (n, 2)), axis=0).clip(-90, 80)
    size = 30 + np.cumsum(rng.normal(0, 0.5, (n, 2)), axis=0).clip(-15, 15)
    return np.column_stack([place, size])


def noisy(truth, scale=4.0, seed=1):
    """Return estimated boxes with positive sizes."""
    boxes = truth + np.random.default_rng(seed).normal(0, scale, truth.shape)
    boxes[:, 2:] = np.maximum(boxes[:, 2:], 1.0)
    return boxes


def states_of(n, failures=(), skip=5):
    """Return the states of a supervised run of n frames with failures."""
    states = np.full(n, FrameState.TRACKED)
    states[:1] = FrameState.INITIALISED
    for frame in failures:
        states[frame] = FrameState.FAILED
        states[frame + 1 : frame + skip] = FrameState.SKIPPED
        states[frame + skip : frame + skip + 1] = FrameState.INITIALISED
    return states


def answer_of(boxes, **further):
    """Return estimates that every preset accepts."""
    boxes = np.asarray(boxes, float)
    return RunEstimates(boxes, **{"states": states_of(len(boxes)), **further})
