"""What the motion map says where the camera moves: no more of the target than of all else.

Edges change all over the image, some tenths of the pixels, and with them the adaptive threshold
rises.
"""

import pandas as pd

from bench.papers.scenes import short_runs
from datasets import Sequence
from datasets.text_form import parse_text

__all__ = ["MOVING_CAMERA", "measure"]

MOVING_CAMERA = ("multipart/1", "nummiaro2003/traffic")
"""Sequences of other suites in which the camera follows the target."""

FRAMES = 50
QUICK_FRAMES = 12
DETAILS = ("changing", "moving", "moving_inside")


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `camera`; see `bench.papers.wang2010.checks`."""
    first = sequence.first_frame
    part = sequence[first : first + (QUICK_FRAMES if quick else FRAMES)]
    (run,) = short_runs(part, ["wang2010:preset=as-written"])
    moves = parse_text(sequence.name)[0] in MOVING_CAMERA
    rows = pd.DataFrame({detail: run.details[detail][1:] for detail in DETAILS})
    rows.insert(0, "camera", "moving" if moves else "at rest")
    rows.insert(1, "frame", range(first + 1, first + len(part)))
    return {"camera": rows}
