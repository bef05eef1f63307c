"""What of the moving things the map B finds, by the window of the differences (WA-4)."""

import pandas as pd

from bench.papers.wang2010.checks.motion import MovingThings, averaged, found, latest
from bench.papers.wang2010.plain import moving
from datasets import Sequence

__all__ = ["measure"]

WINDOWS = (1, 3, 5, 7)
FRAMES = 25


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wa-4`; see `bench.papers.wang2010.checks`."""
    things = MovingThings(sequence)
    rows = []
    for frame in things.frames(5 if quick else FRAMES):
        images = latest(sequence, frame)
        swept = things.swept(range(frame - 2, frame + 1))
        for window in WINDOWS:
            marked = moving(averaged(images, window))
            rows.append(
                {"window": window, "frame": frame}
                | found(marked, things[frame])
                | {"precision_swept": found(marked, swept)["precision"]}
            )
    return {"wa-4": pd.DataFrame(rows)}
