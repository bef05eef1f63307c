"""The paper's figures, and pictures of our own.

Fig. 4 is a flow chart. Those of one step of the tracker (`stages`), and film strips, are drawn for
both presets. Runs keep no contours and no maps: those that are shown are made once more, and are
the same. Which are shown was chosen before any run: the first scene, frames evenly spaced.
"""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.papers.context import Context
from bench.papers.moreno2005.example import (
    COLOUR,
    COLOURS,
    POSITION,
    POSITIONS,
    SETTINGS,
    chain,
    course,
)
from bench.papers.moreno2005.stages import (
    hypotheses_figure,
    snake_figure,
    step_of,
    true_contour,
)
from bench.papers.scenes import short_runs
from bench.statistics.intervals import mean_interval
from reports.colour_space import path_plot
from reports.curves import curve_plot
from reports.densities import Densities, density_plot
from reports.film_strip import evenly_spaced, film_strip
from reports.overlay import TRUTH
from reports.palette import colours
from trackers.contours.chain import Hypotheses
from trackers.contours.observation import colours_of

__all__ = ["colour_path_figure", "density_figure", "error_plot", "film_strips", "iteration"]
__all__ += ["mean_colours", "step_figures"]

Strip: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]

METHODS = {
    "as written": "moreno2005:preset=as-written",
    "recommended (post hoc)": "moreno2005",
}
"""What is drawn of the tracker, by what is said of it."""

PRESETS = {"": "as written", "-recommended": "recommended (post hoc)"}
"""The same, by what it adds to a picture's name."""

BASELINE = "smooth colour, a = 1"

FILTERS = {
    "observation": "observation",
    "independent": "independent features",
    "dependent": "dependent features",
    "unweighted": "dependent, whatever the weights (not in the paper)",
}
"""Of Fig. 2, by what the legend says."""

SHOWN_SET, SHOWN_SAMPLES, SHOWN_FRAME = "B", 500, 40
"""Of Fig. 1: the printed weights with middling observations; a frame of the first course."""

GRIDS = np.linspace(*COLOURS, 121), np.linspace(*POSITIONS, 161)
"""Colours and positions at which the densities of Fig. 1 are told."""

SHOWN = {
    7: "moreno2005/ellipse:scene=40:steps=independent",
    8: "moreno2005/octopus:camouflage=0.75:scene=40",
    9: "moreno2005/book:scene=40",
    10: "moreno2005/leaf:scene=40",
}
"""Sequences of the film strips, by the paper's figures."""

COMPARED = (9, 10)
"""Figures whose first row is the baseline's; that of the others has the frames alone."""

J_IS = "region similarity of the contour's inside and the true region"

FRAMES = 6  # of a strip
WIDTH = 1940  # of a strip, so that frames have about their own size
UNKNOWN = 90  # grey of a frame without a map
MARKS = 6  # frames of a path whose numbers are written


def step_figures(context: Context) -> dict[str, Figure]:
    """Fig. 5 and 6 by name."""
    figures = {}
    for ending, label in PRESETS.items():
        step = step_of(METHODS[label])
        figures[f"figure-5{ending}"] = hypotheses_figure(step, label)
        figures[f"figure-6{ending}"] = snake_figure(step, label)
    return figures


def density_figure(context: Context) -> Figure:
    """Fig. 1: the densities that take part in one iteration of the example."""
    before, after = iteration()
    return density_plot(
        "Fig. 1, another course: densities of one iteration, p₁ of the colour, p₂ of the position, "
        "and P of both; 500 samples, λ = 1",
        {"t - 1": before, "t": after},
        GRIDS,
        ("colour", "position"),
    )


def iteration() -> list[Densities]:
    """What the filters hold before an iteration and after it, on `GRIDS`."""
    seen = course(SETTINGS[SHOWN_SET], SHOWN_FRAME + 1, np.random.default_rng([0]))
    cues = chain("dependent", SETTINGS[SHOWN_SET], SHOWN_SAMPLES, seen.start)
    generator = np.random.default_rng([0, SHOWN_SAMPLES, 1])
    steps = [cues.step(observed, generator) for observed in seen.observed]
    return [
        _densities(when, steps[frame], seen.truth[frame], seen.observed[frame])
        for when, frame in (("t - 1", -2), ("t", -1))
    ]


def _densities(
    when: str, found: tuple[Hypotheses, ...], truth: Array, observed: Array
) -> Densities:
    """p₁, p₂ and P = p₁ p₂, of the pairs of a position and the colour attached to it."""
    colour, position = found
    attached = colour.states[position.attached]
    estimate = position.weights @ attached, position.weights @ position.states
    of_position = _density(GRIDS[1], position.states, position.weights)
    return Densities(
        _density(GRIDS[0], colour.states, colour.weights).sum(axis=0),
        of_position.sum(axis=0),
        of_position.T @ _density(GRIDS[0], attached, np.ones(len(attached))),
        {
            f"true, {when}": (truth[COLOUR], truth[POSITION]),
            f"estimated, {when}": estimate,
            f"observed, {when}": (observed[COLOUR], observed[POSITION]),
        },
    )


def _density(grid: Array, samples: Array, weights: Array) -> Array:
    """Each sample's share (samples, grid) of a kernel estimate; Silverman's width."""
    mean = np.average(samples, weights=weights)
    deviation = np.sqrt(np.average((samples - mean) ** 2, weights=weights))
    width = 1.06 * deviation * len(samples) ** -0.2
    kernels = np.exp(-0.5 * ((grid - samples[:, np.newaxis]) / width) ** 2)
    return np.asarray(weights[:, np.newaxis] * kernels / (width * np.sqrt(2 * np.pi)))


def error_plot(context: Context) -> Figure:
    """Fig. 2: errors against the number of samples, by set of parameters."""
    errors = context.tables["one-dimensional-errors"]
    rows = []
    for (name, number, kind), repeated in errors.groupby(["set", "samples", "filter"], sort=False):
        interval, setting = mean_interval(repeated["error"]), SETTINGS[str(name)]
        rows.append(
            {
                "panel": f"{name}: λ = {setting.scale:g}, σ_obs = {setting.observed[0]:g}",
                "label": FILTERS[str(kind)],
                "setting": number,
                "value": repeated["error"].mean(),
                "low": interval.low,
                "high": interval.high,
            }
        )
    return curve_plot(
        pd.DataFrame(rows),
        "Fig. 2, other parameters: error of position and colour; the paper's curves can't be read. "
        "λ = 1 is printed, λ = 0.2 was tuned",
        "number of samples",
        "error",
        list(FILTERS.values()),
        heading=f"means and 95 % intervals over {errors['repetition'].nunique()} repetitions",
        ticks=range(0, 501, 100),
    )


def colour_path_figure(context: Context) -> Figure:
    """Above Fig. 7: mean colours of the ellipse by frame."""
    sequence = datasets.load(SHOWN[7])
    path = mean_colours(sequence)
    return path_plot(
        path,
        f"Fig. 7, top, not the paper's video but {sequence.name}: path of the target's "
        "mean colour in RGB space; frames of the strip are marked",
        evenly_spaced(0, len(path) - 1, MARKS),
    )


def mean_colours(sequence: datasets.Sequence) -> Array:
    """Mean RGB (n, 3) in [0, 1] of what is seen of the target by frame; NaN where nothing is."""
    path = np.full((len(sequence), 3), np.nan)
    for frame, image in enumerate(sequence):
        mask = sequence.mask(frame)
        if mask is not None and mask.any():
            path[frame] = colours_of(image[mask]).mean(axis=0)
    return path


def film_strips(context: Context) -> dict[str, Strip | None]:
    """Fig. 7 to 10 by name, two a figure; None where there is no run. A quick look has none."""
    strips = dict[str, Strip | None]()
    for number, shown in SHOWN.items() if not context.effort.quick else ():
        sequence = datasets.load(shown)
        pictures = {}
        for ending, proposed in PRESETS.items():
            texts = {proposed: METHODS[proposed]}
            if number in COMPARED:  # the baseline with the same contours, weights and snake
                texts[BASELINE] = METHODS[proposed].replace("moreno2005", "contour-smooth-color", 1)
            experiment = context.description.experiment(f"figure-{number}")
            runs_of = (context.stored.of(experiment, sequence.name, one) for one in texts.values())
            strips[f"figure-{number}{ending}"] = None
            if all(runs_of):
                pictures[ending] = texts
        wanted = [text for texts in pictures.values() for text in texts.values()]
        made = dict(zip(wanted, short_runs(sequence, wanted), strict=True)) if wanted else {}
        for ending, texts in pictures.items():
            found = {label: made[text] for label, text in texts.items()}
            strips[f"figure-{number}{ending}"] = _strip(sequence, found, number)
    return strips


def _strip(sequence: datasets.Sequence, found: Mapping[str, Run], figure: int) -> Strip:
    """Three rows of the same frames; the last has the posterior maps of the proposed method."""
    (proposed, run), *others = found.items()
    numbers = evenly_spaced(sequence.first_frame, len(sequence) - 1, FRAMES)
    truth = {number: true_contour(sequence, number) for number in numbers}
    title = f"Fig. {figure}, not the paper's video but {sequence.name}, repetition 0"
    shades = colours([*METHODS, BASELINE])

    def row(words: str, label: str, of: Run) -> Strip:
        """Frames with a method's contours."""
        contours = {number: _array(of, number, "contour", np.empty((0, 2))) for number in numbers}
        assert of.segmentation is not None  # a tracker that gives masks, and a truth of masks
        values = of.segmentation.region_similarity
        said = {number: f"(J = {values[number]:.2f})" for number in numbers}
        return film_strip(
            sequence.__getitem__,
            numbers,
            {TRUTH: truth, label: contours},
            words,
            FRAMES,
            WIDTH,
            shape="contour",
            shades=shades,
            words=said | {numbers[0]: "(given)"},
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


def _array(run: Run, frame: int, name: str, otherwise: Array) -> Array:
    """What a tracker kept of a frame; in the first frame it was given all, and says nothing."""
    return np.asarray(run.arrays[frame][name], np.float64) if frame in run.arrays else otherwise


def _grey(values: Array) -> Strip:
    """A map in [0, 1] as an image."""
    return np.repeat(np.round(255 * values).astype(np.uint8)[..., np.newaxis], 3, axis=2)
