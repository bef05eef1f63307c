"""Whether the appearance condition tells the target from the background (Equations 13 to 15)."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, ellipses_in, spaced
from bench.papers.nummiaro2003.checks.running import tracker
from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.colour.joint import JointBins
from trackers.histograms.elliptic.background import Background, spacing_of

__all__ = ["Condition", "condition", "measure"]

Array = NDArray[np.float64]

VISIBLE = 0.8
FRAMES = 50
FRAMES_OF_POSITIONS = 5
FINE_STEP = 0.25  # of "all the positions" [Hx]; nearer ones are hardly new


class Condition(NamedTuple):
    """Mean μ and deviation σ of the background's coefficients, and the frame they are from."""

    mean: float
    deviation: float
    frame: int

    @property
    def threshold(self) -> float:
        """μ + 2 σ."""
        return self.mean + 2 * self.deviation


def condition(sequence: Sequence, model: Model) -> Condition:
    """The appearance condition as the tracker makes it, from as many positions.

    It is from the last frame without the target, where the sequence begins with such; else
    from the first frame without the target's surroundings.
    """
    first = sequence.first_frame
    frame = max(first - 1, 0)
    target = ellipses_in(sequence.boxes[first])
    without = target[:2] if frame == first else None
    image = sequence[frame]
    positions = tracker(sequence, 0).parameters.background_positions
    spacing = spacing_of(positions, target[2:], (image.shape[1], image.shape[0]))
    background = _background(image, target[2:], spacing, without)
    found = background.coefficients(model.histogram)
    return Condition(float(found.mean()), float(found.std()), frame)


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `appearance` and `background`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    target = ellipses_in(sequence.boxes[first])
    model = Model(sequence[first], target)
    found = condition(sequence, model)
    appearance = []
    for frame in clear_frames(sequence, 5 if quick else FRAMES, VISIBLE):
        ellipse = ellipses_in(sequence.boxes[frame])
        coefficient = float(model.coefficients(sequence[frame], ellipse[np.newaxis])[0])
        appearance.append(
            {
                "frame": frame,
                "visibility": float(sequence.visibility[frame]),
                "coefficient": coefficient,
                "mean": found.mean,
                "deviation": found.deviation,
                "threshold": found.threshold,
                "above_threshold": float(coefficient > found.threshold),
            }
        )
    others = spaced(np.arange(len(sequence)), 2 if quick else FRAMES_OF_POSITIONS)
    positions = []
    for frame in sorted({found.frame, *others}):
        coefficients = _without_target(sequence, frame, target[2:], model)
        if len(coefficients):
            positions.append(
                {
                    "frame": frame,
                    "positions": len(coefficients),
                    "below_threshold": float(np.mean(coefficients <= found.threshold)),
                    "own": float(frame == found.frame),
                }
            )
    return {"appearance": pd.DataFrame(appearance), "background": pd.DataFrame(positions)}


def _without_target(sequence: Sequence, frame: int, half_axes: Array, model: Model) -> Array:
    """Coefficients of ellipses of a size all over a frame; none whose box meets the true one."""
    background = _background(sequence[frame], half_axes, FINE_STEP * float(half_axes[0]), None)
    coefficients = background.coefficients(model.histogram)
    if not sequence.present[frame]:
        return coefficients
    x, y, half_width, half_height = ellipses_in(sequence.boxes[frame])
    reach = half_axes + [half_width, half_height]
    apart = (np.abs(background.positions - [x, y]) >= reach).any(axis=1)
    return np.asarray(coefficients[apart])


def _background(
    image: Image, half_axes: Array, spacing: float, without: Array | None
) -> Background:
    return Background(SharedFrame(image), half_axes, spacing, JointBins(), "isotropic", without)
