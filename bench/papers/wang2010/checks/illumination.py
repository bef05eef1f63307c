"""How much the map of colour changes with the light, without and with value (WA-3)."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.scenes import with_gain
from bench.papers.wang2010.checks.motion import target_mask
from bench.papers.wang2010.plain import Template, colour_bins, make_template
from bench.papers.wang2010.plain.windows import whole_size, window_slices
from datasets import Sequence
from trackers.base.interface import Box, Image

__all__ = ["measure"]

Array = NDArray[np.float64]

ALPHA = 0.7  # weight of the hue
BINS = 32
FRAMES = 10
GAINS = (0.5, 0.75, 1.25, 1.5)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-3`; see `bench.papers.wang2010.checks`."""
    template = make_template(sequence[0], sequence.boxes[0])
    values = _value_histogram(sequence[0], sequence.boxes[0])
    rows = []
    for frame in range(0, len(sequence), -(-len(sequence) // (2 if quick else FRAMES))):
        image, mask = sequence[frame], target_mask(sequence, frame)
        if not mask.any():
            continue
        plain = _maps(image, template, values)
        for gain in GAINS:
            for name, changed in _maps(with_gain(image, gain), template, values).items():
                inside, before = changed[mask], plain[name][mask]
                total = float(before.sum())
                rows.append(
                    {
                        "map": name,
                        "gain": gain,
                        "frame": frame,
                        "inside": float(inside.mean()),
                        "change": float(np.abs(inside - before).sum()) / total if total else np.nan,
                    }
                )
    return {"wa-3": pd.DataFrame(rows)}


def _maps(image: Image, template: Template, values: Array) -> dict[str, Array]:
    """Maps of colour: the text's, and one in which value shares the weight of saturation."""
    hue, saturation = colour_bins(image, BINS, BINS)
    main, second = ALPHA * template.hue[hue], template.saturation[saturation]
    third = values[_value_bins(image)]
    return {
        "without value": main + (1 - ALPHA) * second,
        "with value": main + (1 - ALPHA) * (second + third) / 2,
    }


def _value_histogram(image: Image, box: Box) -> Array:
    """Histogram of the value in a box, over its largest bin."""
    x, y, width, height = box.tolist()
    size = whole_size(width), whole_size(height)
    patch = image[window_slices(image.shape, x + width / 2, y + height / 2, *size)]
    counts = np.bincount(_value_bins(patch).ravel(), minlength=BINS)
    return np.asarray(counts / counts.max())


def _value_bins(image: Image) -> NDArray[np.int64]:
    return np.asarray(image.max(axis=2).astype(np.int64) * BINS // 256)
