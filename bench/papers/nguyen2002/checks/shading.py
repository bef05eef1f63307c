"""How far features of the target's pixels change in shade, over how far they spread (NG-21)."""

from collections.abc import Callable

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.nguyen2002.checks.follower import FEATURES
from bench.papers.nguyen2002.checks.made_up import wholly_seen
from datasets import Sequence, SequenceError
from trackers.base.interface import Box
from trackers.templates.features import features_of

__all__ = ["measure"]

Array = NDArray[np.float64]

SHADE = 0.5  # light in the shade
EDGE = 0.1  # of the width, over which light turns into shade
DARKEST = 0.4  # light where a surface turns away most


def _shade_edge(across: Array, down: Array) -> Array:
    """The left half of the box lies in the shade."""
    lit = np.clip((across - 0.5) / EDGE + 0.5, 0, 1)
    return np.asarray(SHADE + (1 - SHADE) * lit)


def _shading(across: Array, down: Array) -> Array:
    """The surface turns away from the light towards the left and the right."""
    away = np.cos(np.clip(2 * across - 1, -1, 1) * np.arccos(DARKEST))
    return np.asarray(away + 0 * down)


LIGHTS: dict[str, Callable[[Array, Array], Array]] = {
    "shade": _shade_edge,
    "shading": _shading,
}


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `ng-21`; see `bench.papers.nguyen2002.checks`."""
    part = wholly_seen(sequence, 1, 1)
    if part is None:
        return {}
    mask = part.mask(0)
    if mask is None:
        raise SequenceError(f"{part.name}, {part.frame_name(0)}: there is no mask.")
    image = part[0]
    rows = []
    for cause, gain_of in LIGHTS.items():
        gain = gain_of(*_places(part.boxes[0], image.shape))
        changed = np.round(image * gain[:, :, np.newaxis]).astype(np.uint8)
        for features in FEATURES:
            before, after = (features_of(one, features)[mask] for one in (image, changed))
            spread = np.maximum(before.std(axis=0), 1e-9)
            change = np.abs(after - before).mean(axis=0)
            row = {"cause": cause, "features": features, "change": float((change / spread).mean())}
            rows.append(row)
    return {"ng-21": pd.DataFrame(rows)}


def _places(box: Box, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Pixel centres in shares of a box, from its left and from its top."""
    x, y, width, height = box.tolist()
    down, across = np.indices(shape[:2]) + 0.5
    return (across - x) / width, (down - y) / height
