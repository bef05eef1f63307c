"""The paper's Fig. 7 to 10: film strips with contours and posterior maps, of runs made anew.

Runs keep no contours and no maps: those that are shown are made once more, and are the same.
Which are shown was fixed before any run: scene 0, repetition 0, frames evenly spaced.
"""

from collections.abc import Mapping
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.papers.moreno2005 import FIGURES
from bench.papers.moreno2005.curves import METHODS
from bench.papers.short_runs import runs
from bench.papers.stored import StoredRuns
from datasets import Sequence
from reports.film_strip import evenly_spaced, film_strip
from reports.overlay import TRUTH
from reports.palette import colours
from trackers.contours.contour.outline import outline

__all__ = ["BASELINE", "PRESETS", "SHOWN", "Shown", "film_strips", "true_contour"]

PRESETS = {"": "as written", "-recommended": "recommended (post hoc)"}
"""Methods of `curves`, by what they add to a picture's name."""

BASELINE = "smooth colour, a = 1"

J_IS = "region similarity of the contour's inside and the true region"

FRAMES = 6
WIDTH = 1940  # of a strip, so that frames have about their own size
SPACING = 3.0  # pixels between the points of the true contour
UNKNOWN = 90  # grey of a frame without a map

Strip: TypeAlias = NDArray[np.uint8]
Contour: TypeAlias = NDArray[np.float64]


class Shown(NamedTuple):
    """What a figure shows.

    Attributes
    ----------
    sequence : str
        Its first scene.
    compared : bool
        Whether the first row is the baseline's; else it has the frames themselves. As in the paper.
    """

    sequence: str
    compared: bool


SHOWN: Mapping[int, Shown] = {
    7: Shown("moreno2005/ellipse", compared=False),
    8: Shown("moreno2005/octopus", compared=False),
    9: Shown("moreno2005/book", compared=True),
    10: Shown("moreno2005/leaf:jump=start", compared=True),
}


def film_strips(stored: StoredRuns) -> dict[str, Strip]:
    """Strips by name, two a figure; none where there is no run."""
    strips = {}
    for number, shown in SHOWN.items():
        sequence = datasets.load(shown.sequence)
        pictures = {}
        for ending, proposed in PRESETS.items():
            texts = {proposed: METHODS[proposed]}
            if shown.compared:
                texts[BASELINE] = _baseline_of(METHODS[proposed])
            if all(stored.of(FIGURES[number], sequence.name, text) for text in texts.values()):
                pictures[ending] = texts
        wanted = [text for texts in pictures.values() for text in texts.values()]
        made = dict(zip(wanted, runs(sequence, wanted), strict=True)) if wanted else {}
        for ending, texts in pictures.items():
            found = {label: made[text] for label, text in texts.items()}
            strips[f"figure-{number}{ending}"] = _strip(sequence, found, number)
    return strips


def true_contour(sequence: Sequence, frame: int) -> Contour:
    """Outlines of all that is seen of the target, its parts set apart by rows of NaN.

    Returns
    -------
    ndarray of float64, shape (points, 2)
        In pixels; no rows where nothing is seen, or nothing is known of it.
    """
    mask = sequence.mask(frame)
    pieces = [np.empty((0, 2))]
    if mask is not None:
        number, parts = cv2.connectedComponents(mask.astype(np.uint8))
        for part in range(1, number):
            pixels = parts == part
            # A disc of n pixels has a rim of 2 √(π n); other shapes have a longer one.
            points = max(8, round(2 * np.sqrt(np.pi * np.count_nonzero(pixels)) / SPACING))
            pieces += [outline(pixels, points), np.full((1, 2), np.nan)]
    return np.concatenate(pieces)


def _baseline_of(text: str) -> str:
    """The baseline with the same contours, weights and snake."""
    return text.replace("moreno2005", "contour-smooth-color", 1)


def _strip(sequence: Sequence, found: Mapping[str, Run], figure: int) -> Strip:
    """Three rows of the same frames; the last has the posterior maps of the proposed method."""
    (proposed, run), *others = found.items()
    numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, FRAMES)
    truth = {number: true_contour(sequence, number) for number in numbers}
    title = f"Fig. {figure}, not the paper's video but {sequence.name}, scene 0, repetition 0"
    shades = colours(list(METHODS))

    def row(words: str, label: str, of: Run) -> Strip:
        """Frames with a method's contours."""
        contours = {number: _array(of, number, "contour", np.empty((0, 2))) for number in numbers}
        return film_strip(
            sequence.__getitem__,
            numbers,
            {TRUTH: truth, label: contours},
            words,
            FRAMES,
            WIDTH,
            shape="contour",
            shades=shades,
            words=_similarities(of, numbers),
        )

    first = (
        row(f"{title}. Contours with smooth colour, a = 1, {proposed}; J: {J_IS}", *others[0])
        if others
        else film_strip(sequence.__getitem__, numbers, {}, f"{title}. Frames", FRAMES, WIDTH)
    )
    second = row(f"Proposed method, {proposed}; J: {J_IS}", proposed, run)
    blank = np.full(sequence[numbers[0]].shape[:2], UNKNOWN / 255.0)
    maps = film_strip(
        lambda number: _grey(_array(run, number, "posterior", blank)),
        numbers,
        {TRUTH: truth},
        "Posterior maps of the colours that the contours support most; white: the target",
        FRAMES,
        WIDTH,
        shape="contour",
        words={numbers[0]: "(given)"},
    )
    return np.vstack([first, second, maps])


def _array(run: Run, frame: int, name: str, otherwise: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a tracker kept of a frame; in the first frame it was given all, and says nothing."""
    return np.asarray(run.arrays[frame][name], np.float64) if frame in run.arrays else otherwise


def _similarities(run: Run, numbers: list[int]) -> dict[int, str]:
    """J of a run in the frames after the first, for a reader."""
    assert run.segmentation is not None  # a tracker that gives masks, on a sequence that has them
    values = run.segmentation.region_similarity
    said = {number: f"(J = {values[number]:.2f})" for number in numbers}
    return said | {numbers[0]: "(given)"}


def _grey(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    """A map in [0, 1] as an image."""
    return np.repeat(np.round(255 * values).astype(np.uint8)[..., np.newaxis], 3, axis=2)
