"""Steps of the tracker in one frame: Fig. 3, 5 and 6 of the paper.

The figures show frame 10 of the first scene in repetition 0. The frame was chosen before any run.
"""

from math import ceil, floor
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.metrics.regions import region_similarity
from trackmark.bench.papers.moreno2005.colour_plots import (
    ColourModel,
    Palette,
    colour_model_plot,
    hypotheses_plot,
)
from trackmark.bench.papers.plots import Panel, map_plot
from trackmark.datasets.interface import Image, Mask
from trackmark.trackers.base.catalogue import run_seed
from trackmark.trackers.base.interface import Estimate
from trackmark.trackers.contours.chain import Chain, Hypotheses
from trackmark.trackers.contours.mixture import from_components
from trackmark.trackers.contours.observation import Observation, colour_cells, to_rgb
from trackmark.trackers.contours.outline import bounding_box, fill_contour, outline
from trackmark.trackers.contours.plane_cue import plane_basis
from trackmark.trackers.contours.posterior import posterior
from trackmark.trackers.contours.snake import MARGIN, edge_map
from trackmark.trackers.moreno2005 import Moreno2005

STEPS = 10  # number of updates

CELLS = 160  # grid points along each axis of the plane
AROUND = 0.08  # margin around the colours on the plane, as a share of their extent
SPACING = 3.0  # distance between points of the true contour [px]

Array: TypeAlias = NDArray[np.float64]


class KeepingChain(Chain):
    """Chain that stores the hypotheses of the last frame by cue."""

    hypotheses: tuple[Hypotheses, ...] = ()

    def step(
        self, observation: Observation, generator: np.random.Generator
    ) -> tuple[Hypotheses, ...]:
        """See `Chain.step`."""
        self.hypotheses = super().step(observation, generator)
        return self.hypotheses


class Step(NamedTuple):
    """State of the tracker after a frame.

    `mask`: visible part of the target. `planes`, `colours`, `contours`: hypotheses of the three
    cues. `bases`: axes of the colour planes, shape (n, 3, 2). `n_target_components`: number of
    components that model the target; they precede those of the background. `estimate`: estimate
    with `arrays`. `cells`: column index into `colours.evidence` for each pixel.
    """

    image: Image
    mask: Mask
    planes: Hypotheses
    colours: Hypotheses
    contours: Hypotheses
    bases: Array
    n_target_components: int
    estimate: Estimate
    cells: NDArray[np.int32]

    def posterior(self, index: int) -> Array:
        """Return the posterior map of a pair of mixtures, shape (height, width)."""
        values: Array = self.colours.evidence[index][self.cells].astype(np.float64)
        return values


def step_of(spec: str, scene: str) -> Step:
    """Run a tracker (a specification) on the first frames of a scene."""
    sequence = datasets.load(scene)
    tracker = _started_tracker(spec, sequence)
    chain = KeepingChain(tracker.chain.cues, tracker.chain.association, tracker.chain.feedback)
    tracker.chain = chain
    first = sequence.first_frame
    for frame in range(first + 1, first + STEPS + 1):
        image, mask = sequence[frame], sequence.mask(frame)
        estimate = tracker.update(image)
    assert mask is not None
    planes, colours, contours = chain.hypotheses
    settings = tracker.parameters
    return Step(
        image=image,
        mask=mask,
        planes=planes,
        colours=colours,
        contours=contours,
        bases=plane_basis(planes.states, tracker.planes.basis),
        n_target_components=settings.object_components,
        estimate=estimate,
        cells=colour_cells(image, settings.colour_levels).image,
    )


def colour_model_figure(scene: str) -> Figure:
    """Draw Fig. 3: the colour model of the first frame."""
    return colour_model_plot(
        model_of(datasets.load(scene)),
        f"Fig. 3, frame 0 of {scene}: colours that were drawn, their model on the Fisher plane "
        "(ellipses: two deviations), and the posterior of the target (white: 1)",
    )


def model_of(sequence: datasets.Sequence) -> ColourModel:
    """Return the initial colour model of the tracker in the setting `as-written`."""
    tracker = _started_tracker("moreno2005:preset=as-written", sequence)
    first = sequence.first_frame
    image = sequence[first]
    basis, fit = tracker.planes.basis, tracker.refitted.fits[0]
    points = {"target": fit.target_colours, "background": fit.background_colours}
    projected = np.concatenate(list(points.values())) @ basis
    low, high = projected.min(axis=0), projected.max(axis=0)
    more = AROUND * (high - low)
    x, y = np.linspace(low - more, high + more, CELLS).T
    plane_points = np.stack(np.meshgrid(x, y), axis=-1)

    def posterior_at(where: Array) -> Array:
        flat = posterior(where.reshape(-1, 2), fit.target, fit.background)
        return flat.reshape(where.shape[:2])

    return ColourModel(
        image=image,
        contour=true_contour(sequence, first),
        points=points,
        basis=basis,
        mixtures={"target": fit.target, "background": fit.background},
        grid=(x, y),
        on_plane=posterior_at(plane_points),
        on_image=posterior_at(to_rgb(image) @ basis),
    )


def _started_tracker(tracker_spec: str, sequence: datasets.Sequence) -> Moreno2005:
    """Return the tracker of repetition 0 after its initialisation."""
    spec = parse_tracker(tracker_spec)
    tracker = spec.make(run_seed(spec.name, sequence.name, 0))
    assert isinstance(tracker, Moreno2005)
    first = sequence.first_frame
    tracker.init(sequence[first], sequence.boxes[first], sequence.mask(first))
    return tracker


def true_contour(sequence: datasets.Sequence, frame: int) -> Array:
    """Return the outlines of the visible parts [px], shape (points, 2), separated by rows of NaN.

    The result has no rows without a mask or if the target is invisible.
    """
    mask = sequence.mask(frame)
    outlines = [np.empty((0, 2))]
    if mask is not None:
        n_labels, components = cv2.connectedComponents(mask.astype(np.uint8))
        for label in range(1, n_labels):
            pixels = components == label
            # 2 √(π n) is the perimeter of a disc of n pixels, the shortest of all shapes.
            points = max(8, round(2 * np.sqrt(np.pi * np.count_nonzero(pixels)) / SPACING))
            outlines += [outline(pixels, points), np.full((1, 2), np.nan)]
    return np.concatenate(outlines)


def hypotheses_figure(step: Step, label: str) -> Figure:
    """Draw Fig. 5: planes, contours, and colour hypotheses of large, median and small weight."""
    return hypotheses_plot(
        step.image,
        (step.bases, step.planes.weights),
        (step.contours.states, step.contours.weights),
        palettes_of(step),
        f"Fig. 5, {label}, frame {STEPS} of the leaf: "
        "hypotheses, darker with more weight; right: three colour hypotheses on their planes, "
        "and their posterior maps",
    )


def palettes_of(step: Step) -> dict[str, Palette]:
    """Return the colour hypotheses with the largest, median and smallest weight, by label."""
    weights = step.colours.weights
    order = np.argsort(-weights, kind="stable")
    ranks = {"greatest": 0, "median": len(order) // 2, "least": len(order) - 1}
    palettes = {}
    for rank_name, rank in ranks.items():
        index = int(order[rank])
        mixture = step.colours.states[index]
        classes = {
            "target": from_components(mixture[: step.n_target_components]),
            "background": from_components(mixture[step.n_target_components :]),
        }
        label = f"{rank_name} weight: {weights[index] * len(weights):.2g} times the mean"
        palettes[label] = Palette(classes, step.posterior(index))
    return palettes


def snake_figure(step: Step, label: str) -> Figure:
    """Draw Fig. 6: the effect of the posterior map on the snake."""
    remark = "" if step.estimate.details["snake"] else " (rejected: the mean contour is kept)"
    return map_plot(
        stages(step),
        f"Fig. 6, {label}, frame {STEPS} of the leaf: steps of the snake's fit{remark}",
        5,
    )


def stages(step: Step) -> list[Panel]:
    """Return panels: posterior map, edges, edges refined by the map, mean contour, snake."""
    arrays = step.estimate.arrays
    mean, snake = arrays["mean_contour"], arrays["contour"]
    left, top, width, height = bounding_box(mean).tolist()
    x, y = max(floor(left) - MARGIN, 0), max(floor(top) - MARGIN, 0)
    near = np.s_[y : ceil(top + height) + MARGIN, x : ceil(left + width) + MARGIN]
    image, posterior_map = step.image[near], arrays["posterior"][near]
    corner = np.array([x, y])
    agree = [
        region_similarity(fill_contour(contour, *step.mask.shape), step.mask)
        for contour in (mean, snake)
    ]
    return [
        Panel("(a) posterior map", posterior_map.astype(np.float64)),
        Panel("(b) edges", edge_map(image, None)),
        Panel("(c) edges that remain with (a)", edge_map(image, posterior_map)),
        Panel(f"(d) mean, J = {agree[0]:.2f}", image, contour=mean - corner),
        Panel(f"(e) snake, J = {agree[1]:.2f}", image, contour=snake - corner),
    ]
