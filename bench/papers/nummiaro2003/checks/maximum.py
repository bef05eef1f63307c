"""Whether the mean state lies at the maximum of the Bhattacharyya coefficient (Fig. 2)."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.evaluation.record import Run
from bench.papers.nummiaro2003.checks.appearance import Model, clear_frames, ellipses_in, grid
from bench.papers.nummiaro2003.checks.running import PRESETS, runs
from datasets import Sequence

__all__ = ["measure"]

Array = NDArray[np.float64]

LENGTH = 100  # frames of the run
FRAMES = 15
REACH = 1.5  # of the surface, to each side [half axes]
NEAR = 0.25  # [Hx]


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `maximum`, `surface`, `surface_particles`; see `bench.papers.nummiaro2003.checks`.

    The model is not updated, so that the surface is that of the model which the tracker has.
    """
    first = sequence.first_frame
    part = sequence[: first + (20 if quick else LENGTH)]
    model = Model(sequence[first], ellipses_in(sequence.boxes[first]))
    frames = clear_frames(part, 2 if quick else FRAMES)
    rows: list[dict[str, object]] = []
    surfaces, particles = [], []
    options = [{"preset": preset, "model_update": "false"} for preset in PRESETS]
    for preset, run in zip(PRESETS, runs(part, options), strict=True):
        for frame in frames:
            row, surface = _found(part, run, model, frame)
            rows.append({"preset": preset, **row})
            if frame == frames[-1]:
                surfaces.append(surface.assign(preset=preset, frame=frame))
                drawn = _drawn(run, frame, surface)
                particles.append(drawn.assign(preset=preset, frame=frame))
    return {
        "maximum": pd.DataFrame(rows),
        "surface": pd.concat(surfaces, ignore_index=True) if surfaces else pd.DataFrame(),
        "surface_particles": pd.concat(particles, ignore_index=True)
        if particles
        else pd.DataFrame(),
    }


def _found(
    part: Sequence, run: Run, model: Model, frame: int
) -> tuple[dict[str, float], pd.DataFrame]:
    """Row of a frame, and the surface around the target, at the mean state's size."""
    truth, mean = ellipses_in(part.boxes[frame]), ellipses_in(run.boxes[frame])
    half_width = float(truth[2])
    middle = np.concatenate([np.floor(truth[:2]) + 0.5, mean[2:]])
    reach = float(REACH * truth[2]), float(REACH * truth[3])
    places = grid(middle, reach, (1.0, 1.0))
    coefficients = model.coefficients(part[frame], places)
    best = places[coefficients.argmax()]
    distance = float(np.hypot(*(mean - best)[:2])) / half_width
    weights = run.arrays[frame]["weights"]
    offsets = run.arrays[frame]["particles"][:, :2] - mean[:2]
    row = {
        "frame": frame,
        "visibility": float(part.visibility[frame]),
        "distance": distance,
        "near": float(distance <= NEAR),
        "spread": float(np.sqrt(weights @ (offsets**2).sum(axis=1))) / half_width,
        "coefficient": float(model.coefficients(part[frame], mean[np.newaxis])[0]),
        "greatest": float(coefficients.max()),
    }
    surface = pd.DataFrame(places[:, :2], columns=["x", "y"]).assign(coefficient=coefficients)
    return row, surface


def _drawn(run: Run, frame: int, surface: pd.DataFrame) -> pd.DataFrame:
    """Ellipses that a picture shows beside the surface."""
    mean = ellipses_in(run.boxes[frame])
    best = mean.copy()
    best[:2] = surface[["x", "y"]].to_numpy()[surface["coefficient"].argmax()]
    particles = run.arrays[frame]["particles"]
    ellipses = np.vstack([particles[:, [0, 1, 4, 5]], mean, best])
    weights = [*run.arrays[frame]["weights"].tolist(), 1.0, 1.0]
    drawn = pd.DataFrame(ellipses, columns=["x", "y", "half_width", "half_height"])
    kinds = ["particle"] * len(particles) + ["mean", "greatest"]
    return drawn.assign(kind=kinds, weight=weights)
