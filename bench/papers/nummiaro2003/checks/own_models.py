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
    pairs = [
        _Pair(sequence, preset, repetition)
        for preset in PRESETS
        for repetition in range(1 if quick else REPETITIONS)
    ]
    times, wrong = [], []
    for frame in range(first + 1, end):
        image, truth = sequence[frame], sequence.boxes[frame]
        examined = (frame - first) % EVERY == 0 and sequence.present[frame]
        around = clutter(ellipses_in(truth), image, STEPS_A_WIDTH) if examined else None
        for pair in pairs:
            labels = {"preset": pair.preset, "repetition": pair.repetition, "frame": frame}
            seconds, box = pair.update(image)
            if frame - first in TIMED:
                times.append(labels | seconds)
            if around is not None:
                wrong.append(
                    {
                        **labels,
                        "visibility": float(sequence.visibility[frame]),
                        "inside": float(centre_inside(truth, box)[0]),
                        "nearer_clutter": nearer(pair.models, pair.original, image, around),
                    }
                )
    return {"model_times": pd.DataFrame(times), "wrong_models": pd.DataFrame(wrong)}


class _Pair:
    """Trackers with one model for all particles and with one for each, on the same frames."""

    def __init__(self, sequence: Sequence, preset: str, repetition: int) -> None:
        self.preset, self.repetition = preset, repetition
        first = sequence.first_frame
        image, box = sequence[first], sequence.boxes[first]
        self._one, self._each = (
            tracker(sequence, repetition, preset=preset, models=models)
            for models in ("one", "per-particle")
        )
        self.original = self._one.histogram_of(image, box)
        for begun in (self._one, self._each):
            if first > 0:
                begun.watch(sequence[first - 1])
            begun.init(image, box)

    def update(self, image: Image) -> tuple[dict[str, float], Array]:
        """CPU seconds of both by name, and the box of the latter."""
        began = thread_time()
        self._one.update(image)
        between = thread_time()
        box = self._each.update(image).box
        return {"one": between - began, "per_particle": thread_time() - between}, box

    @property
    def models(self) -> Array:
        """Those of the particles: too large to be among the arrays that a run keeps."""
        models = self._each._model.models
        assert models is not None
        return models


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
