"""The paper's Fig. 3, colours of a leaf and the model of them; above Fig. 7, the ellipse's path."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.experiments.contestant import contestant, run_seed
from bench.papers.moreno2005.strips import SHOWN, true_contour
from reports.colour_space import ColourModel, Gaussians, colour_model_plot, path_plot
from reports.film_strip import evenly_spaced
from trackers.contours.fisher.mixture import Mixture
from trackers.contours.fisher.posterior import posterior
from trackers.contours.segmentation.observation import colours_of
from trackers.moreno2005 import Moreno2005

__all__ = ["colour_model_figure", "colour_path_figure", "gaussians", "mean_colours", "model_of"]

SEQUENCE = "moreno2005/leaf:jump=middle"
"""Its first scene; the paper's is a leaf, too."""

TRACKER = "moreno2005:preset=as-written"
CELLS = 160  # of the plane, along either axis
MARGIN = 0.08  # of the plane around the colours, as a share of their extent
MARKS = 6  # frames of a path whose numbers are written

Array = NDArray[np.float64]


def colour_model_figure() -> Figure:
    """Fig. 3: what the tracker makes of the first frame, as it was classified by hand."""
    sequence = datasets.load(SEQUENCE)
    return colour_model_plot(
        model_of(sequence),
        f"Fig. 3, not the paper's picture but frame 0 of {sequence.name}, scene 0. Colours that "
        "were drawn, their model on the Fisher plane (ellipses: two deviations), and the posterior "
        "of the target by it (white: 1)",
    )


def model_of(sequence: datasets.Sequence) -> ColourModel:
    """The colour model that the tracker starts with.

    Parameters
    ----------
    sequence : Sequence
        With a mask of the first frame.
    """
    chosen = contestant(TRACKER)
    tracker = chosen.make(run_seed(chosen.name, sequence.name, 0))
    assert isinstance(tracker, Moreno2005)
    first = sequence.first_frame
    image = sequence[first]
    tracker.init(image, sequence.boxes[first], sequence.mask(first))
    basis, fit = tracker.planes.basis, tracker.refitted.fits[0]
    floor = tracker.parameters.colour_floor
    points = {"target": fit.target_colours, "background": fit.background_colours}
    at = np.concatenate(list(points.values())) @ basis
    low, high = at.min(axis=0), at.max(axis=0)
    more = MARGIN * (high - low)
    x, y = np.linspace(low - more, high + more, CELLS).T
    places = np.stack(np.meshgrid(x, y), axis=-1)

    def shown(where: Array) -> Array:
        flat = posterior(where.reshape(-1, 2), fit.target, fit.background, floor)
        return flat.reshape(where.shape[:2])

    return ColourModel(
        image=image,
        contour=true_contour(sequence, first),
        points=points,
        basis=basis,
        mixtures={"target": gaussians(fit.target), "background": gaussians(fit.background)},
        grid=(x, y),
        on_plane=shown(places),
        on_image=shown(colours_of(image) @ basis),
    )


def colour_path_figure() -> Figure:
    """Above Fig. 7: mean colours of the ellipse by frame."""
    sequence = datasets.load(SHOWN[7].sequence)
    path = mean_colours(sequence)
    return path_plot(
        path,
        f"Fig. 7, top, not the paper's video but {sequence.name}, scene 0: path of the target's "
        "mean colour in RGB space; frames of the strip are marked",
        evenly_spaced(0, len(path) - 1, MARKS),
    )


def mean_colours(sequence: datasets.Sequence) -> Array:
    """Mean colour of what is seen of the target.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        RGB in [0, 1] by frame; NaN where nothing is seen, or nothing is known of it.
    """
    path = np.full((len(sequence), 3), np.nan)
    for frame, image in enumerate(sequence):
        mask = sequence.mask(frame)
        if mask is not None and mask.any():
            path[frame] = colours_of(image[mask]).mean(axis=0)
    return path


def gaussians(mixture: Mixture) -> Gaussians:
    """A mixture for pictures."""
    return Gaussians(*mixture)
