"""How much of a target must be seen for its ellipse to look like it."""

import numpy as np
import pandas as pd

from bench.papers.nummiaro2003.checks.appearance import Model, ellipses_in, spaced
from bench.papers.nummiaro2003.checks.background import condition
from datasets import Sequence

__all__ = ["measure"]

FRAMES = 100
HALF = 0.4, 0.6  # visible fractions of a target that is half hidden


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `occlusion` and `occlusion_curve`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    model = Model(sequence[first], ellipses_in(sequence.boxes[first]))
    threshold = condition(sequence, model).threshold
    visibility = sequence.visibility
    partly = np.flatnonzero(sequence.present & (visibility > 0) & (visibility < 1))
    half = partly[(visibility[partly] >= HALF[0]) & (visibility[partly] <= HALF[1])]
    frames = sorted({*spaced(partly, 10 if quick else FRAMES), *half.tolist()})
    rows = []
    for frame in frames:
        ellipse = ellipses_in(sequence.boxes[frame])
        coefficient = float(model.coefficients(sequence[frame], ellipse[np.newaxis])[0])
        rows.append(
            {
                "frame": frame,
                "visibility": float(visibility[frame]),
                "coefficient": coefficient,
                "threshold": threshold,
                "above_threshold": float(coefficient > threshold),
            }
        )
    curve = pd.DataFrame(rows)
    chosen = curve[curve["frame"].isin(half.tolist())] if rows else curve
    return {"occlusion": chosen, "occlusion_curve": curve}
