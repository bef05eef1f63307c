"""The baseline: the same contours, with one smooth model of the colours (section 6)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.moreno2005.plain.colours import SmoothColours
from bench.papers.moreno2005.plain.frame import Frame
from bench.papers.moreno2005.plain.mixtures import Mixture
from bench.papers.moreno2005.plain.planes import basis_on, fisher_basis, normal_of
from bench.papers.moreno2005.plain.segmenter import PlainSegmenter
from trackers.contour_smooth_color import ContourSmoothColor

__all__ = ["PlainContourSmoothColor"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]


class PlainContourSmoothColor(PlainSegmenter):
    """The tracker `contour-smooth-color`.

    Parameters
    ----------
    seed : SeedSequence or int
        Of the random numbers.
    **parameters
        The tracker's, by its names and with its defaults.
    """

    def __init__(self, seed: np.random.SeedSequence | int, **parameters: Any) -> None:
        super().__init__(seed, ContourSmoothColor.Parameters(**parameters))

    def _begin(self, sets: tuple[Array, ...], mixtures: tuple[Mixture, ...]) -> None:
        self._model = SmoothColours(sets, mixtures, self._settings.mixing)
        self._plane = self.basis

    def _hypotheses(self, frame: Frame, image: Image) -> tuple[list[Array], Array]:
        self._random.random(1)  # for the one plane that the one hypothesis goes with
        return [self._table(frame, self._model.predicted(), self._plane)], np.ones(1)

    def _feed_back(self, joint: Array) -> None:
        """The one hypothesis has all the weight."""

    def _learn(self, image: Image, mask: Mask) -> None:
        """Mixtures of the last frame, on the first frame's plane or on its own."""
        sets = self._later_sets(image, mask)
        if not sets:
            return
        moved = self._settings.plane == "refitted"
        if moved:
            normal = normal_of(fisher_basis(*sets))
            side = 1 if normal @ normal_of(self.basis) >= 0 else -1
            self._plane = basis_on(side * normal, self.basis)
        self._model.learn(sets, self._plane, moved=moved)
