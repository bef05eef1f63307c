"""How far the compiled trackers are from the same methods in plain NumPy."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

import datasets
from bench.metrics.centre_error import centre_error
from bench.papers.wang2010.costs import METHODS, make

__all__ = ["greatest_differences"]


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
        `sequence`, `method` (a key of `METHODS`), `difference` [pixels].
    """
    rows = []
    for name in names:
        sequence = datasets.load(name)
        number = len(sequence) if frames is None else min(frames, len(sequence))
        images = [sequence[frame] for frame in range(number)]
        for method in METHODS:
            plain, compiled = (make(method, kind) for kind in ("plain", "compiled"))
            for one in (plain, compiled):
                one.init(images[0], sequence.boxes[0])
            ours = np.array([compiled.update(image).box for image in images[1:]])
            theirs = np.array([plain.update(image) for image in images[1:]])
            difference = float(centre_error(theirs, ours).max())
            rows.append({"sequence": name, "method": method, "difference": difference})
    return pd.DataFrame(rows)
