"""False occlusions and overlap by the noise of the camera, with the same settings (NG-22)."""

from typing import get_args

import numpy as np
import pandas as pd

from bench.evaluation.record import Trace
from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.checks.follower import FEATURES
from bench.papers.nguyen2002.checks.made_up import wholly_seen
from bench.papers.nguyen2002.events import declared_in
from bench.papers.short_runs import runs
from bench.papers.views import with_noise
from datasets import Sequence
from datasets.interface import Frames, Image
from trackers.templates.features import Features

__all__ = ["Noisy", "lines", "measure"]

DEVIATIONS = (1.0, 2.0, 4.0, 8.0)  # of what is added [grey levels]
FRAMES, QUICK_FRAMES = 100, 30
"""Nearly three times L, as an occlusion that is declared in vain may hide the next L frames."""

METRICS = ["mean_overlap", "false_occlusions"]
QUICK_FEATURES: tuple[Features, ...] = ("rgb", "invariants")


class Noisy:
    """Frames with noise of a sensor, the same whenever they are asked for.

    Parameters
    ----------
    frames : Frames
    deviation : float
        In grey levels.
    """

    def __init__(self, frames: Frames, deviation: float) -> None:
        self._frames, self._deviation = frames, deviation

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, frame: int) -> Image:
        generator = np.random.default_rng(frame)
        return with_noise(self._frames[frame], self._deviation, generator)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `ng-22` and `ng-22-lines`; see `bench.papers.nguyen2002.checks`."""
    frames = QUICK_FRAMES if quick else FRAMES
    part = wholly_seen(sequence, frames, frames)
    if part is None:
        return {}
    chosen = QUICK_FEATURES if quick else FEATURES
    texts = [f"nguyen2002:preset=as-written:features={features}" for features in chosen]
    rows = []
    for deviation in DEVIATIONS:
        noisy = part[:]
        noisy.frames = Noisy(part.frames, deviation)
        for features, run in zip(chosen, runs(noisy, texts), strict=True):
            declared = 100 * len(declared_in(run)) / frames
            rows += [
                {
                    "features": features,
                    "trace": trace,
                    "noise": deviation,
                    "false_occlusions": declared,
                    "mean_overlap": float(overlap(part.boxes, run.boxes_in(trace)).mean()),
                }
                for trace in get_args(Trace)
            ]
    found = pd.DataFrame(rows)
    return {"ng-22": found, "ng-22-lines": lines(found)}


def lines(rows: pd.DataFrame) -> pd.DataFrame:
    """Straight lines through what was found at each noise, by features and trace.

    Parameters
    ----------
    rows : DataFrame
        `ng-22` of one sequence.

    Returns
    -------
    DataFrame
        Likewise, where the lines are at the least and at the greatest noise: what lies between is
        their slope, times the range.
    """
    ends = np.array([min(DEVIATIONS), max(DEVIATIONS)])
    found = []
    for (features, trace), group in rows.groupby(["features", "trace"], sort=False):
        at_ends = {
            name: np.polyval(np.polyfit(group["noise"], group[name], 1), ends) for name in METRICS
        }
        found.append(pd.DataFrame({"features": features, "trace": trace, "noise": ends, **at_ends}))
    return pd.concat(found, ignore_index=True)
