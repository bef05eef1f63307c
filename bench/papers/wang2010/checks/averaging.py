"""What of the moving things B finds with one difference and with the mean of two (WA-5)."""

from math import ceil

import numpy as np
import pandas as pd

from bench.metrics.centre_error import centres
from bench.papers.wang2010.checks.motion import MovingThings, averaged, found
from bench.papers.wang2010.checks.views import with_noise
from bench.papers.wang2010.plain import local_difference, moving
from datasets import Sequence

__all__ = ["measure"]

FRAMES = 8
STEPS = (0.5, 1.0, 2.0, 3.0)
"""Frames from one image to the next: every image shown twice, all frames, every other, …"""
NOISES = (0.0, 4.0, 8.0, 16.0)  # deviations of what is added [grey levels]


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-5`; see `bench.papers.wang2010.checks`."""
    generator = np.random.default_rng(0)
    things = MovingThings(sequence)
    middles = centres(sequence.boxes)
    rows = []
    for frame in things.frames(2 if quick else FRAMES):
        for step in STEPS:
            for phase, seen in enumerate(_seen(frame, step)):
                if seen[-1] < 0:
                    continue
                speed = step * float(np.hypot(*(middles[frame] - middles[frame - 1])))
                labels = {"step": step, "phase": phase, "speed": speed, "frame": frame}
                swept = things.swept(seen)
                for noise in NOISES:
                    image, previous, earlier = (
                        with_noise(sequence[number], noise, generator) for number in seen
                    )
                    maps = {
                        "one": moving(local_difference(image, previous)),
                        "two": moving(averaged((image, previous, earlier))),
                    }
                    for differences, marked in maps.items():
                        rows.append(
                            {"differences": differences, "noise": noise}
                            | labels
                            | found(marked, things[frame])
                            | {"precision_swept": found(marked, swept)["precision"]}
                        )
    return {"wa-5": pd.DataFrame(rows)}


def _seen(frame: int, step: float) -> list[tuple[int, int, int]]:
    """Frames of the last three images, latest first; of images shown twice, both times."""
    if step >= 1:
        wide = ceil(step)
        return [(frame, frame - wide, frame - 2 * wide)]
    return [(frame, frame - 1, frame - 1), (frame, frame, frame - 1)]
