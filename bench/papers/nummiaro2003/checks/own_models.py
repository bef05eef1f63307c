"""What a target model for each particle costs, and what such models come to look like."""

from time import thread_time

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centre_inside
from bench.papers.nummiaro2003.checks.appearance import clutter, ellipses_in
from bench.papers.nummiaro2003.checks.running import PRESETS, tracker
from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.colour.counting import ellipse_histograms
from trackers.colour.joint import JointBins
from trackers.nummiaro2003 import Nummiaro2003

__all__ = ["measure", "nearer"]

Array = NDArray[np.float64]

REPETITIONS = 2
TIMED = range(5, 60)  # frames after the first: warm, and the target still whole
EVERY = 5  # frames
STEPS_A_WIDTH = 2  # of the clutter


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Tables `model_times` and `wrong_models`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    end = first + 1 + TIMED.stop if quick else len(sequence)
    times, wrong = [], []
    for preset in PRESETS:
        for repetition in range(1 if quick else REPETITIONS):
            labels = {"preset": preset, "repetition": repetition}
            both = {
                models: _begun(sequence, preset, models, repetition)
                for models in ("one", "per-particle")
            }
            original = both["per-particle"].histogram_of(sequence[first], sequence.boxes[first])
            for frame in range(first + 1, end):
                image = sequence[frame]
                seconds, boxes = {}, {}
                for models, follower in both.items():
                    began = thread_time()
                    boxes[models] = follower.update(image).box
                    seconds[models.replace("-", "_")] = thread_time() - began
                if frame - first in TIMED:
                    times.append({**labels, "frame": frame, **seconds})
                if (frame - first) % EVERY == 0 and sequence.present[frame]:
                    ellipse = ellipses_in(sequence.boxes[frame])
                    around = clutter(ellipse, image, STEPS_A_WIDTH)
                    models_now = _models(both["per-particle"])
                    truth, estimate = sequence.boxes[[frame]], boxes["per-particle"]
                    wrong.append(
                        {
                            **labels,
                            "frame": frame,
                            "visibility": float(sequence.visibility[frame]),
                            "inside": float(centre_inside(truth, estimate)[0]),
                            "nearer_clutter": nearer(models_now, original, image, around),
                        }
                    )
    return {"model_times": pd.DataFrame(times), "wrong_models": pd.DataFrame(wrong)}


def nearer(models: Array, original: Array, image: Image, around: Array) -> float:
    """Share of the models whose coefficient with some ellipse exceeds that with the original.

    Parameters
    ----------
    models : ndarray of float64, shape (n, bins)
        Normalised histograms.
    original : ndarray of float64, shape (bins,)
        The first of them.
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    around : ndarray of float64, shape (k, 4)
        The ellipses.
    """
    colours = JointBins()
    every = np.arange(colours.n_bins)
    found = ellipse_histograms(SharedFrame(image), around, "isotropic", colours, every)
    others = found.counts / np.maximum(found.totals, 1)[:, np.newaxis]
    greatest = (np.sqrt(models) @ np.sqrt(others).T).max(axis=1)
    return float(np.mean(greatest > np.sqrt(models) @ np.sqrt(original)))


def _begun(sequence: Sequence, preset: str, models: str, repetition: int) -> Nummiaro2003:
    """A tracker with the first frame behind it."""
    begun = tracker(sequence, repetition, preset=preset, models=models)
    first = sequence.first_frame
    if first > 0:
        begun.watch(sequence[first - 1])
    begun.init(sequence[first], sequence.boxes[first])
    return begun


def _models(follower: Nummiaro2003) -> Array:
    """The particles' models: too large to be among the arrays that a run keeps."""
    models = follower._model._models
    assert models is not None
    return models
