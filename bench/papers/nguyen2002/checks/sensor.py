"""False occlusions and overlap by the noise of the camera, with the same settings (NG-22)."""

import numpy as np
import pandas as pd

from bench.metrics.overlap import overlap
from bench.papers.nguyen2002.checks.follower import FEATURES
from bench.papers.nguyen2002.checks.made_up import wholly_seen
from bench.papers.short_runs import runs
from bench.papers.views import with_noise
from datasets import Sequence
from datasets.interface import Frames, Image
from trackers.template.features import Features

__all__ = ["Noisy", "measure"]

DEVIATIONS = (1.0, 2.0, 4.0, 8.0)  # of what is added [grey levels]
LEAST, MOST = 30, 40  # frames
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
    """Table `ng-22`; see `bench.papers.nguyen2002.checks`."""
    part = wholly_seen(sequence, LEAST, LEAST if quick else MOST)
    if part is None:
        return {}
    chosen = QUICK_FEATURES if quick else FEATURES
    texts = [f"nguyen2002:preset=as-written:features={features}" for features in chosen]
    rows = []
    for deviation in DEVIATIONS:
        noisy = part[:]
        noisy.frames = Noisy(part.frames, deviation)
        for features, run in zip(chosen, runs(noisy, texts), strict=True):
            hidden = run.details["occluded"][1:] == 1
            declared = 100 * float((hidden & ~np.roll(hidden, 1)).sum()) / len(hidden)
            revised = run.boxes if run.revised is None else run.revised
            for trace, boxes in {"revised": revised, "online": run.boxes}.items():
                rows.append(
                    {
                        "features": features,
                        "trace": trace,
                        "noise": deviation,
                        "false_occlusions": declared,
                        "mean_overlap": float(overlap(part.boxes, boxes).mean()),
                    }
                )
    return {"ng-22": pd.DataFrame(rows)}
