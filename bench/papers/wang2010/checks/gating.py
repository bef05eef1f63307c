"""How much of what the maps mark lies on the target: colour, motion and both (WA-7, Fig. 1)."""

import numpy as np
import pandas as pd

from bench.papers.wang2010.checks.motion import averaged, latest, target_mask
from bench.papers.wang2010.plain import colour_map, make_template, moving
from datasets import Sequence

__all__ = ["measure"]

FIGURE = (10, 11)  # frames 11 and 12 of the paper
FRAMES = 25


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-7`; see `bench.papers.wang2010.checks`."""
    template = make_template(sequence[0], sequence.boxes[0])
    every = -(-len(sequence) // (5 if quick else FRAMES))
    rows = []
    frames = {*FIGURE, *range(2, len(sequence), every)}.intersection(range(len(sequence)))
    for frame in sorted(frames):
        images = latest(sequence, frame)
        mask = target_mask(sequence, frame)
        if not mask.any():
            continue
        colour = colour_map(images[0], template)
        marked = moving(averaged(images)).astype(np.float64)
        maps = {"colour": colour, "moving": marked, "colour and moving": marked * colour}
        for name, values in maps.items():
            total = float(values.sum())
            rows.append(
                {
                    "map": name,
                    "frame": frame,
                    "figure": float(frame in FIGURE),
                    "inside": float(values[mask].sum()) / total if total else np.nan,
                    "covered": float(np.count_nonzero(values[mask])) / np.count_nonzero(mask),
                }
            )
    return {"wa-7": pd.DataFrame(rows)}
