"""Whether saturation beside hue sets a target off from surroundings of similar hue (WA-2)."""

import numpy as np
import pandas as pd

from bench.papers.wang2010.checks.motion import target_mask
from bench.papers.wang2010.plain import colour_map, make_template
from datasets import Sequence
from trackers.base.interface import Box, Mask

__all__ = ["measure", "surroundings"]

ALPHAS = {"hue": 1.0, "hue and saturation": 0.7}
SIMILAR = ("on the face", "similar background")  # attributes
QUICK_FRAMES = 10


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-2`; see `bench.papers.wang2010.checks`."""
    template = make_template(sequence[0], sequence.boxes[0])
    similar = np.zeros(len(sequence), np.bool_)
    for attribute in SIMILAR:
        similar |= sequence.attributes.get(attribute, False)
    rows = []
    for frame in range(1, len(sequence), max(1, len(sequence) // QUICK_FRAMES) if quick else 1):
        image, mask = sequence[frame], target_mask(sequence, frame)
        around = surroundings(sequence.boxes[frame], mask)
        if not mask.any() or not around.any():
            continue
        for name, alpha in ALPHAS.items():
            colour = colour_map(image, template, alpha)
            inside, outside = float(colour[mask].mean()), float(colour[around].mean())
            both = inside + outside
            rows.append(
                {
                    "map": name,
                    "frame": frame,
                    "similar": float(similar[frame]),
                    "inside": inside,
                    "outside": outside,
                    "difference": inside - outside,
                    "contrast": (inside - outside) / both if both else 0.0,
                }
            )
    return {"wa-2": pd.DataFrame(rows)}


def surroundings(box: Box, mask: Mask) -> Mask:
    """Pixels within a width and a height of the target's box that do not show it."""
    x, y, width, height = box.tolist()
    rows, columns = np.indices(mask.shape) + 0.5
    beside = (columns >= x - width) & (columns < x + 2 * width)
    level = (rows >= y - height) & (rows < y + 2 * height)
    return np.asarray(beside & level & ~mask)
