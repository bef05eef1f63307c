"""What target models of the particles' own come to look like."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.metrics.centre_error import centre_inside
from bench.papers.nummiaro2003.checks.appearance import clutter, ellipses_in
from bench.papers.nummiaro2003.checks.running import PRESETS, tracker
from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.colour.counting import ellipse_histograms
from trackers.histograms.colour.joint import JointBins

__all__ = ["measure", "nearer"]

Array = NDArray[np.float64]

REPETITIONS = 2
QUICK_FRAMES = 60
EVERY = 5  # frames
STEPS_A_WIDTH = 2  # of the clutter


def measure(sequence: Sequence, quick: bool) -> dict[str, pd.DataFrame]:
    """Table `wrong_models`; see `bench.papers.nummiaro2003.checks`."""
    first = sequence.first_frame
    image, box = sequence[first], sequence.boxes[first]
    begun = []
    for preset in PRESETS:
        for repetition in range(1 if quick else REPETITIONS):
            one = tracker(sequence, repetition, preset=preset, models="per-particle")
            if first > 0:
                one.watch(sequence[first - 1])
            one.init(image, box)
            begun.append(({"preset": preset, "repetition": repetition}, one))
    original = begun[0][1].histogram_of(image, box)
    rows = []
    for frame in range(first + 1, first + 1 + QUICK_FRAMES if quick else len(sequence)):
        image, truth = sequence[frame], sequence.boxes[frame]
        examined = (frame - first) % EVERY == 0 and sequence.present[frame]
        around = clutter(ellipses_in(truth), image, STEPS_A_WIDTH) if examined else None
        shown = SharedFrame(image, len(begun))
        for labels, one in begun:
            estimate = one.update_shared(shown)
            if around is not None:
                models = one._model.models
                assert models is not None
                rows.append(
                    {
                        **labels,
                        "frame": frame,
                        "visibility": float(sequence.visibility[frame]),
                        "inside": float(centre_inside(truth, estimate.box)[0]),
                        "nearer_clutter": nearer(models, original, image, around),
                    }
                )
    return {"wrong_models": pd.DataFrame(rows)}


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
