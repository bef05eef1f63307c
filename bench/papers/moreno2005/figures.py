"""Figures of the paper on our sequences: densities, errors, steps of the tracker, film strips.

Stored runs contain neither contours nor maps. For the film strips the trackers therefore run again
on the first scene of each sequence. Frames are evenly spaced.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTINGS
from trackmark.bench.papers.moreno2005.example import (
    COLOUR,
    COLOURS,
    FILTERS,
    NUMBERS,
    POSITION,
    POSITIONS,
    SET_B,
    chain,
    errors,
    trajectory,
)
from trackmark.bench.papers.moreno2005.example_plots import Densities, density_plot, error_plot
from trackmark.bench.papers.moreno2005.stages import (
    colour_model_figure,
    hypotheses_figure,
    snake_figure,
    step_of,
    true_contour,
)
from trackmark.bench.papers.runs import Context
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.overlay import TRUTH, evenly_spaced, film_strip
from trackmark.trackers.contours.chain import Hypotheses

Strip: TypeAlias = NDArray[np.uint8]
Array: TypeAlias = NDArray[np.float64]
Frames: TypeAlias = Mapping[int, Mapping[str, Any]]

SHOWN_SAMPLES, SHOWN_FRAME = 500, 40  # step of Fig. 1, on the first trajectory
GRIDS = np.linspace(*COLOURS, 121), np.linspace(*POSITIONS, 161)
"""Colours and positions at which the densities of Fig. 1 are evaluated."""

REPETITIONS = 40  # trajectories of Fig. 2
STRIPS = {7: "ellipse", 8: "octopus", 9: "book", 10: "leaf"}
COMPARED = ("book", "leaf")  # sequences that the paper also shows with the baseline
FRAMES, WIDTH = 6, 1940  # frames of a strip
UNKNOWN = 0.35  # grey level of a frame without a map


def density_figure(context: Context) -> Figure:
    """Draw Fig. 1: the densities of one iteration of the example."""
    before, after = iteration()
    return density_plot(
        "Fig. 1, another trajectory: densities of one iteration, p₁ of the colour, p₂ of the "
        "position, and P of both; 500 samples, λ = 1",
        {"t - 1": before, "t": after},
        GRIDS,
        ("colour", "position"),
    )


def iteration() -> list[Densities]:
    """Return the densities of the filters before and after an iteration, on `GRIDS`."""
    seen = trajectory(SET_B, SHOWN_FRAME + 1, np.random.default_rng([0]))
    cues = chain("dependent", SET_B, SHOWN_SAMPLES, seen.start)
    generator = np.random.default_rng([0, SHOWN_SAMPLES, 1])
    steps = [cues.step(observed, generator) for observed in seen.observed]
    return [
        _densities(when, steps[frame], seen.truth[frame], seen.observed[frame])
        for when, frame in (("t - 1", -2), ("t", -1))
    ]


def _densities(
    when: str, hypotheses: tuple[Hypotheses, ...], truth: Array, observed: Array
) -> Densities:
    """Return p₁, p₂ and P = p₁ p₂ for pairs of a position and its attached colour."""
    colour, position = hypotheses
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
    """Return each sample's part of a kernel density estimate, shape (samples, grid).

    The bandwidth follows Silverman's rule.
    """
    mean = np.average(samples, weights=weights)
    deviation = np.sqrt(np.average((samples - mean) ** 2, weights=weights))
    width = 1.06 * deviation * len(samples) ** -0.2
    kernels = np.exp(-0.5 * ((grid - samples[:, np.newaxis]) / width) ** 2)
    return np.asarray(weights[:, np.newaxis] * kernels / (width * np.sqrt(2 * np.pi)))


def error_figure(context: Context) -> Figure:
    """Draw Fig. 2: error of position and colour against the number of samples."""
    rows = []
    for n_samples in NUMBERS:
        error_table = pd.DataFrame(errors(run, n_samples) for run in range(REPETITIONS))
        for label in ("observation", *FILTERS):
            low, high = mean_interval(error_table[label])
            point = {
                "samples": n_samples,
                "value": error_table[label].mean(),
                "low": low,
                "high": high,
            }
            rows.append({"label": label, **point})
    title = "Fig. 2, λ = 1, other parameters chosen by us: error of position and colour"
    heading = f"means and 95 % intervals over {REPETITIONS} trajectories"
    return error_plot(pd.DataFrame(rows), title, ["observation", *FILTERS], heading)


def step_figures(context: Context) -> dict[str, Figure]:
    """Draw Fig. 3, 5 and 6 on a frame of the leaf; Fig. 5 and 6 in both settings."""
    scene = context.paper.first_scene("leaf")
    figures = {"figure-3": colour_model_figure(scene)}
    for setting in SETTINGS:
        step = step_of(context.paper.spec("full", setting), scene)
        figures[f"figure-5-{setting}"] = hypotheses_figure(step, setting)
        figures[f"figure-6-{setting}"] = snake_figure(step, setting)
    return figures


def film_strips(context: Context) -> dict[str, Strip]:
    """Draw Fig. 7 to 10: contours of the method and of the baseline, and posterior maps."""
    requests = []
    for figure, sequence in STRIPS.items():
        scene = context.paper.first_scene(sequence)
        trackers = ["full", *(["smooth colour"] if sequence in COMPARED else [])]
        specs = {
            f"{tracker}, {setting}": context.paper.spec(tracker, setting)
            for tracker in trackers
            for setting in SETTINGS
        }
        requests.append((figure, scene, specs))
    strips = map_in_workers(_strip, requests, context.jobs)
    return {f"figure-{figure}": strip for figure, strip in zip(STRIPS, strips, strict=True)}


def _strip(request: tuple[int, str, Mapping[str, str]]) -> Strip:
    """Draw frames of a scene: one row of contours per tracker, one row of maps per setting.

    A request has the number of the figure, the scene, and trackers by their labels.
    """
    figure, scene, specs = request
    sequence = datasets.load(scene)
    frames = evenly_spaced(sequence.first_frame, len(sequence) - 1, FRAMES)
    truth = {frame: true_contour(sequence, frame) for frame in frames}
    trackers = [(parse_tracker(spec), 0) for spec in specs.values()]
    runs = run_protocol(trackers, sequence, keep_arrays=True).runs
    rows = []
    for label, run in zip(specs, runs, strict=True):
        if run.failure or run.segmentation is None:
            continue
        values = run.segmentation.region_similarity
        similarities = {frame: f"(J = {values[frame]:.2f})" for frame in frames[1:]}
        contours = {
            frame: _array(run.arrays, frame, "contour", np.empty((0, 2))) for frame in frames
        }
        rows.append(
            film_strip(
                sequence.__getitem__,
                frames,
                {TRUTH: truth, label.partition(",")[0]: contours},
                f"Fig. {figure}, {scene}: {label}",
                FRAMES,
                WIDTH,
                shape="contour",
                remarks={frames[0]: "(given)", **similarities},
            )
        )
        if label.startswith("full"):
            rows.append(_maps(sequence, run.arrays, frames, truth, label))
    return np.vstack(rows)


def _maps(
    sequence: datasets.Sequence, arrays: Frames, frames: list[int], truth: Any, label: str
) -> Strip:
    blank = np.full(sequence[frames[0]].shape[:2], UNKNOWN)
    return film_strip(
        lambda frame: _grey(_array(arrays, frame, "posterior", blank)),
        frames,
        {TRUTH: truth},
        f"Posterior maps of the best colours, {label.partition(', ')[2]}; white: the target",
        FRAMES,
        WIDTH,
        shape="contour",
        remarks={frames[0]: "(given)"},
    )


def _array(arrays: Frames, frame: int, name: str, otherwise: Array) -> Array:
    """Return an array that the tracker stored for a frame; None in the init frame."""
    return np.asarray(arrays[frame][name], np.float64) if frame in arrays else otherwise


def _grey(values: Array) -> Strip:
    """Convert a map in [0, 1] to a BGR image."""
    return np.repeat(np.round(255 * values).astype(np.uint8)[..., np.newaxis], 3, axis=2)
