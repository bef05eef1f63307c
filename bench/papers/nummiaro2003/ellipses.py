"""Histograms of ellipses as the tracker sees them, and where else in a scene to look."""

from collections.abc import Iterable, Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from datasets import Sequence
from trackers.base.interface import Image
from trackers.base.sharing import SharedFrame
from trackers.histograms.bins import JointBins
from trackers.histograms.ellipses import Kernel, coefficients
from trackers.histograms.target_model import Ellipses

__all__ = [
    "Array",
    "Model",
    "clear_frames",
    "clutter",
    "ellipses_in",
    "first_model",
    "grid",
    "shown",
    "spaced",
]

Array: TypeAlias = NDArray[np.float64]

CLEAR = 0.95  # visible fraction from which a target counts as not hidden
WIDTHS = 3  # of the target, around which clutter lies


class Model:
    """Histogram of an ellipse, and coefficients of others with it.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        BGR.
    ellipse : ndarray of float64, shape (4,)
        Centre x and y, Hx and Hy [pixels].
    colours : JointBins
        How pixels are binned.
    kernel : {'isotropic', 'epanechnikov', 'uniform'}
        How they are weighted.

    Attributes
    ----------
    histogram : ndarray of float64, shape (bins,)
        Normalised.
    """

    def __init__(
        self,
        image: Image,
        ellipse: Array,
        colours: JointBins | None = None,
        kernel: Kernel = "isotropic",
    ) -> None:
        self._ellipses = Ellipses(colours or JointBins(), kernel)
        every = np.arange(self._ellipses.colours.n_bins)
        counted = self._ellipses.counts(SharedFrame(image), _at_rest(ellipse[np.newaxis]), every)
        self.histogram: Array = counted.counts[0] / counted.totals[0]
        self._bins = np.flatnonzero(counted.counts[0])

    def coefficients(self, image: Image, ellipses: Array) -> Array:
        """ρ of ellipses (n, 4); 0 with less than a quarter inside the image."""
        counted = self._ellipses.counts(SharedFrame(image), _at_rest(ellipses), self._bins)
        return coefficients(counted.counts, counted.totals, self.histogram[np.newaxis, self._bins])

    def coefficient(self, image: Image, ellipse: Array) -> float:
        """ρ of one ellipse."""
        return float(self.coefficients(image, ellipse[np.newaxis])[0])


def first_model(
    sequence: Sequence, colours: JointBins | None = None, kernel: Kernel = "isotropic"
) -> Model:
    """That of the true ellipse in the first frame."""
    first = sequence.first_frame
    return Model(sequence[first], ellipses_in(sequence.boxes[first]), colours, kernel)


def ellipses_in(boxes: Array) -> Array:
    """Ellipses in boxes: centre x and y, Hx and Hy, shape (n, 4) as the boxes or (4,) as one."""
    half_axes = boxes[..., 2:] / 2
    return np.concatenate([boxes[..., :2] + half_axes, half_axes], axis=-1)


def grid(ellipse: Array, reach: tuple[float, float], step: float) -> Array:
    """The ellipse moved over a grid, at most by `reach` to each side, shape (n, 4) [pixels]."""
    across, down = (step * np.arange(-int(most / step), int(most / step) + 1) for most in reach)
    offsets = np.stack(np.meshgrid(across, down), axis=2).reshape(-1, 2)
    moved = np.tile(ellipse, (len(offsets), 1))
    moved[:, :2] += offsets
    return moved


def clutter(ellipse: Array, image: Image, steps_a_width: int = 4) -> Array:
    """Ellipses of the same size within three widths that a score would call a miss.

    Parameters
    ----------
    ellipse : ndarray of float64, shape (4,)
        The true one; centres within its box count as on the target.
    image : ndarray of uint8, shape (height, width, 3)
        Centres are inside it.
    steps_a_width : int
        Of the grid.

    Returns
    -------
    ndarray of float64, shape (n, 4)
    """
    width = 2 * float(ellipse[2])
    around = grid(ellipse, (WIDTHS * width, WIDTHS * width), width / steps_a_width)
    hit = (np.abs(around[:, :2] - ellipse[:2]) <= ellipse[2:]).all(axis=1)
    size = np.array(image.shape[1::-1])
    inside = ((around[:, :2] >= 0) & (around[:, :2] <= size)).all(axis=1)
    return around[inside & ~hit]


def clear_frames(sequence: Sequence, most: int, least: float = CLEAR) -> list[int]:
    """At most so many frames after the first, evenly spaced, that show so much of the target."""
    shows = sequence.present & (sequence.visibility >= least)
    shows[: sequence.first_frame + 1] = False
    return spaced(np.flatnonzero(shows), most)


def spaced(frames: NDArray[np.intp], most: int) -> list[int]:
    """At most so many of the frames, evenly spaced."""
    if len(frames) == 0:
        return []
    places = np.linspace(0, len(frames) - 1, most).round().astype(int)
    chosen: list[int] = np.unique(frames[places]).tolist()
    return chosen


def shown(sequence: Sequence, frames: Iterable[int]) -> Iterator[tuple[int, Image, Array]]:
    """Frames in order, with their images and true ellipses."""
    for frame in sorted(frames):
        yield frame, sequence[frame], ellipses_in(sequence.boxes[frame])


def _at_rest(ellipses: Array) -> Array:
    """Ellipses (n, 4) as states of the tracker that do not move, shape (n, 7)."""
    states = np.zeros((len(ellipses), 7))
    states[:, [0, 1, 4, 5]] = ellipses
    return states
