"""What tests of scenes share: scenes and images made once, stretches of frames, grown masks."""

from functools import lru_cache

import cv2
import numpy as np
import pytest
from hypothesis import strategies as st

from trackmark.datasets.synthetic.suite import suites
from trackmark.datasets.versioning import find_version

SEEDS = st.integers(0, 2**32 - 1)


def scenes_of(name):
    """Make functions of a seed (and a frame) and knobs: the scene itself, and its images."""
    (entry,) = (suite.entries[name] for suite in suites() if name in suite.names())

    @lru_cache(maxsize=32)
    def opened(seed, **knobs):
        made, module = entry.opened({"scene": str(seed), **knobs})
        return module.scene(made, *entry.which)

    @lru_cache(maxsize=64)
    def image(seed, frame, **knobs):
        return opened(seed, **knobs).render(frame).astype(float)

    return opened, image


def unless_sealed(name):
    """Return marks of tests of a scene: slow while its source is the one that was sealed.

    Its pixels and truth are then those for which the tests passed (`datasets.versioning`).
    """
    (suite,) = (suite for suite in suites() if name in suite.names())
    seal = find_version(name, suite.golden)
    is_sealed = seal is not None and seal.tree == suite.tree(name)
    return [pytest.mark.slow] if is_sealed else []


def runs(flags):
    """First frames, and those after the last, of every stretch that is true."""
    return np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]]))).reshape(-1, 2)


def grown(mask, by):
    """A mask with all pixels that are so near in either direction."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * by + 1, 2 * by + 1))) > 0
