"""What of the moving things B finds with one difference and with the mean of two (WA-5)."""

import numpy as np
import pandas as pd

from bench.metrics.centre_error import centres
from bench.papers.scenes import with_noise
from bench.papers.wang2010.checks.motion import MovingThings, averaged, found
from bench.papers.wang2010.plain import local_difference, moving
from datasets import Sequence

__all__ = ["measure"]

FRAMES = 12
STEPS = (1, 2, 3)
"""Frames from one image to the next."""
NOISES = (0.0, 4.0, 8.0, 16.0)  # deviations of what is added [grey levels]


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-5`; see `bench.papers.wang2010.checks`."""
    generator = np.random.default_rng(0)
    things = MovingThings(sequence)
    speeds = np.hypot(*np.diff(centres(sequence.boxes), axis=0).T)  # to the next frame
    usual = float(np.nanmedian(speeds))
    rows = []
    for frame in things.frames(2 if quick else FRAMES):
        speed = float(speeds[frame - 1])
        for step in STEPS:
            seen = frame, frame - step, frame - 2 * step
            if seen[-1] < 0:
                continue
            labels = {"step": step, "speed": step * speed, "slow": float(speed < usual)}
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
                        {"differences": differences, "noise": noise, "frame": frame}
                        | labels
                        | found(marked, things[frame])
                        | {"precision_swept": found(marked, swept)["precision"]}
                    )
    return {"wa-5": pd.DataFrame(rows)}
