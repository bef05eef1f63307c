"""Shared helpers of scene tests: cached scenes and images, runs of flags, dilated masks."""

from functools import lru_cache

import cv2
import numpy as np
import pytest
from hypothesis import strategies as st

from trackmark.datasets.catalogue import suites
from trackmark.datasets.versioning import find_version

SEEDS = st.integers(0, 2**32 - 1)


def scenes_of(name):
    """Return cached functions that open a scene by seed, and render an image by seed and frame."""
    (entry,) = (suite.entries[name] for suite in suites() if name in suite.names())

    @lru_cache(maxsize=32)
    def opened(seed, **parameters):
        options = {"scene": str(seed), **parameters}
        return entry.create(entry.parameters.checked(name, options))

    @lru_cache(maxsize=64)
    def image(seed, frame, **parameters):
        return opened(seed, **parameters).render(frame).astype(float)

    return opened, image


def slow_if_unchanged(*names):
    """Return the mark `slow` if the source of all scenes is unchanged since their tests passed."""
    for name in names:
        (suite,) = (suite for suite in suites() if name in suite.names())
        version = find_version(name, suite.golden)
        if version is None or version.tree != suite.tree(name):
            return []
    return [pytest.mark.slow]


def runs(flags):
    """Return first frame and end (exclusive) of each interval of True."""
    return np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]]))).reshape(-1, 2)


def grown(mask, pixels):
    """Return a mask dilated by some pixels."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * pixels + 1, 2 * pixels + 1))) > 0


def box_centres(sequence):
    """Return the centres of the boxes, shape (n, 2)."""
    return sequence.boxes[:, :2] + sequence.boxes[:, 2:] / 2


def mask_edges(mask):
    """Return the left, top, right and bottom edge of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1])
