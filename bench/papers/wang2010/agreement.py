"""How far the compiled trackers are from the same methods in plain NumPy."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

import datasets
from bench.metrics.centre_error import centre_error
from bench.papers.wang2010.costs import make

__all__ = ["SETTINGS", "greatest_differences"]

_SHARP = {"sigma": 0.158}
_ROBUST = {"sigma": 0.1, "radius": 10.0, "difference_window": 7}
_HUE = {"particles": 15, "alpha": 1.0, "beta": 0.0}
_LIMITS = {"minimum_saturation": 0.1, "minimum_value": 0.2, "maximum_value": 0.9}

SETTINGS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "proposed": ("proposed", {}),
    "proposed, recommended": ("proposed", _SHARP),
    "proposed, robust": ("proposed", {**_ROBUST, "stop_distance": 0.5}),
    "proposed, hue alone, N = 15": ("proposed", _HUE),
    "proposed, limits of saturation and value": ("proposed", _LIMITS),
    "particle filter": ("particle_filter", {}),
    "particle filter, recommended": ("particle_filter", _SHARP),
    "particle filter, robust": ("particle_filter", _ROBUST),
    "camshift": ("camshift", {}),
    "camshift, adaptive window": ("camshift", {"window": "adaptive"}),
    "camshift, limits of saturation and value": ("camshift", _LIMITS),
    "improved camshift": ("camshift_improved", {}),
    "improved camshift, adaptive window": ("camshift_improved", {"window": "adaptive"}),
    "improved camshift, robust": (
        "camshift_improved",
        {"stop_distance": 0.5, "difference_window": 7},
    ),
}
"""A key of `costs.METHODS`, and what is not as written, by name."""


def greatest_differences(names: Sequence[str], frames: int | None = None) -> pd.DataFrame:
    """Greatest distance between the two implementations' centres, with equal random numbers.

    Parameters
    ----------
    names : sequence of str
        Sequences.
    frames : int, optional
        How many of each, from the first; all by default.

    Returns
    -------
    DataFrame
        `sequence`, `setting` (a key of `SETTINGS`), `difference` [pixels].
    """
    rows = []
    for name in names:
        sequence = datasets.load(name)
        number = len(sequence) if frames is None else min(frames, len(sequence))
        images = [sequence[frame] for frame in range(number)]
        for setting, (method, options) in SETTINGS.items():
            plain, compiled = (make(method, kind, **options) for kind in ("plain", "compiled"))
            for one in (plain, compiled):
                one.init(images[0], sequence.boxes[0])
            ours = np.array([compiled.update(image).box for image in images[1:]])
            theirs = np.array([plain.update(image) for image in images[1:]])
            difference = float(centre_error(theirs, ours).max())
            rows.append({"sequence": name, "setting": setting, "difference": difference})
    return pd.DataFrame(rows)
