"""Contour particle filter with a smooth colour model: a baseline of Moreno-Noguer et al."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from trackmark.trackers.base.interface import Image, Mask
from trackmark.trackers.base.parameters import bounded, choice, chosen
from trackmark.trackers.contours import plane_cue, segmenter
from trackmark.trackers.contours.chain import Chain, Hypotheses
from trackmark.trackers.contours.colour_cue import N_EM_STEPS, MixtureEvaluator, RefittedColours

__all__ = ["ContourSmoothColor"]


class ContourSmoothColorParameters(segmenter.SegmenterParameters):
    """Parameters of `ContourSmoothColor`."""

    mixing: float = bounded(
        0.5,
        "a of G(t) = (1 - a) G(t-2) + a G(t-1) [fraction]",
        gt=0,
        le=1,
        origin=chosen("a is not printed; 0.5 prefers neither frame, and 1 would mix nothing"),
    )
    plane: Literal["first", "refitted"] = choice(
        "first",
        "colours are projected on the Fisher plane of the first frame, or of the last segmented "
        "frame",
        origin=chosen("not stated; the planes are state of the full method only"),
    )


class ContourSmoothColor(segmenter.Segmenter):
    """A contour particle filter with a smooth colour model.

    Contour particles, weights and snake are those of `moreno2005`. The colours are one pair of
    mixtures, predicted as G(t) = (1 - a) G(t-2) + a G(t-1). Each G is fitted to a segmented frame
    (section 6 of the paper, after Isard & Blake). The paper states neither a nor the plane. It
    calls the model smooth and a its mixing factor. With a = 1, the colours of the last frame,
    nothing is mixed, so a = 0.5 is used, which prefers neither frame. a = 1 is mostly better.
    The plane of the first frame gives worse results than `plane=refitted`. Colours are sampled one
    pixel inside the contour and two outside it, as in the first frame.

    The details and the arrays are those of `moreno2005`.
    """

    name = "contour-smooth-color"
    paper = (
        "F. Moreno-Noguer, A. Sanfeliu, D. Samaras, Integration of conditionally dependent object "
        "features for robust figure-background segmentation, ICCV 2005, section 6; M. Isard, "
        "A. Blake, CONDENSATION - conditional density propagation for visual tracking, IJCV 1998"
    )
    presets = {
        "as-written": {},
        "recommended": segmenter.RECOMMENDED,
    }
    choices = {
        **segmenter.Segmenter.choices,
        "mixtures G(t - 2) and G(t - 1)": (
            "fitted to the last two segmented frames",
            "our reading: the text does not say where a G comes from; a recursion over predictions "
            "would keep the colours of the first frame",
        ),
        "numbers of colours to which they are fitted, target and background": (
            segmenter.REFIT_POINTS,
            "not printed",
        ),
        "steps of expectation maximisation per frame": (
            N_EM_STEPS,
            "not printed; they start from the mixtures of the previous frame",
        ),
    }
    Parameters = ContourSmoothColorParameters

    def chain_from(self, start: segmenter.ChainStart) -> Chain:
        """See `Segmenter.chain_from`."""
        parameters: ContourSmoothColorParameters = self.parameters
        palettes = MixtureEvaluator(parameters.object_components, parameters.weights, 1.0)
        self.plane = plane_cue.GivenPlane(start.basis)
        self.colours = RefittedColours(start.fit, 1, parameters.mixing, palettes)
        return Chain([self.plane, self.colours, self.contour_cue(start)])

    def learn(self, image: Image, inside: Mask, hypotheses: Sequence[Hypotheses]) -> None:
        """Fit the frame's colours on the first plane or on a new plane; see `Segmenter.learn`."""
        sets = self.colour_sets(image, inside)
        if sets is None:
            return
        moved = self.parameters.plane == "refitted"
        if moved:
            normal = plane_cue.plane_normal(plane_cue.discriminant_basis(*sets))
            self.plane.normal = plane_cue.orient_normals(
                normal[np.newaxis], plane_cue.plane_normal(self.plane.basis)
            )[0]
        basis = plane_cue.plane_basis(self.plane.normal[np.newaxis], self.plane.basis)[0]
        self.colours.learn(*sets, basis, moved)
