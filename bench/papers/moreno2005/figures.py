"""Figures of the paper on our sequences: densities, errors, steps of the tracker, film strips.

Stored runs contain neither contours nor maps. For the film strips the trackers therefore run again
on the scene with the median error. Frames are evenly spaced.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.papers import SETTING_LABELS, SETTINGS
from trackmark.bench.papers.figures import median_scene, selection_sentence
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
from trackmark.bench.papers.strips import Image, Note, Strip, StripRow
from trackmark.bench.statistics.intervals import mean_interval
from trackmark.reports.overlay import evenly_spaced
from trackmark.trackers.contours.chain import Hypotheses

Specs: TypeAlias = Mapping[tuple[str, str], str]
Runs: TypeAlias = Mapping[tuple[str, str], Run]
Array: TypeAlias = NDArray[np.float64]
Frames: TypeAlias = Mapping[int, Mapping[str, Any]]

SHOWN_SAMPLES, SHOWN_FRAME = 500, 40  # step of Fig. 1, on the first trajectory
GRIDS = np.linspace(*COLOURS, 121), np.linspace(*POSITIONS, 161)
"""Colours and positions at which the densities of Fig. 1 are evaluated."""

REPETITIONS = 40  # trajectories of Fig. 2
STRIPS = {7: "ellipse", 8: "octopus", 9: "book", 10: "leaf"}
COMPARED = ("book", "leaf")  # sequences that the paper also shows with the baseline
FULL, BASELINE, SHOWN = "full", "smooth colour", "recommended"
FRAMES = 4  # of a strip
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


def film_strips(context: Context) -> dict[str, Strip | None]:
    """Draw Fig. 7 to 10: contours of the method and of the baseline, and posterior maps."""
    paper, requests = context.paper, dict[str, tuple[str, Specs]]()
    for figure, name in STRIPS.items():
        if scene := median_scene(paper.trackers[FULL], paper.sequences[name], context):
            trackers = [FULL, *([BASELINE] if name in COMPARED else [])]
            specs = {
                (tracker, label): paper.spec(tracker, setting)
                for tracker in trackers
                for setting, label in SETTING_LABELS.items()
            }
            requests[f"figure-{figure}"] = scene, specs
    strips = map_in_workers(_strip, requests.values(), context.jobs)
    return dict(zip(requests, strips, strict=True))


def _strip(request: tuple[str, Specs]) -> Strip:
    """Draw frames of a scene: a row of contours per tracker, then the maps of the method.

    A request has the scene, and the specifications of trackers by name and label of the setting.
    """
    scene, specs = request
    sequence = datasets.load(scene)
    frames = evenly_spaced(sequence.first_frame, len(sequence) - 1, FRAMES)
    trackers = [(parse_tracker(spec), 0) for spec in specs.values()]
    runs = dict(zip(specs, run_protocol(trackers, sequence, keep_arrays=True).runs, strict=True))
    images = [sequence[frame] for frame in frames]
    rows = [
        _contours(tracker, runs, images, frames) for tracker in dict.fromkeys(t for t, _ in specs)
    ]
    rows.append(_maps(runs[FULL, SHOWN], images, frames))
    labels = [f"frame {frame}" for frame in frames]
    truth = [true_contour(sequence, frame) for frame in frames]
    return Strip(selection_sentence(scene, FULL), labels, truth, rows, "contour")


def _contours(tracker: str, runs: Runs, images: Sequence[Image], frames: Sequence[int]) -> StripRow:
    """Return a row with the contours of a tracker in both settings, and its J."""
    of_tracker = {label: run for (name, label), run in runs.items() if name == tracker}
    nothing = np.full((1, 2), np.nan)
    contours = [
        {label: _array(run.arrays, frame, "contour", nothing) for label, run in of_tracker.items()}
        for frame in frames
    ]
    notes = [
        [
            Note(
                label, f"J = {run.segmentation.region_similarity[frame]:.2f}" if frame else "given"
            )
            for label, run in of_tracker.items()
            if run.segmentation is not None
        ]
        for frame in frames
    ]
    return StripRow(f"{tracker}: contour", images, contours, notes)


def _maps(run: Run, images: Sequence[Image], frames: Sequence[int]) -> StripRow:
    """Return a row with the posterior maps of the best colours."""
    blank = np.full(images[0].shape[:2], UNKNOWN)
    maps = [_grey(_array(run.arrays, frame, "posterior", blank)) for frame in frames]
    return StripRow(f"{FULL}: posterior map, {SHOWN}", maps, [{}] * len(frames))


def _array(arrays: Frames, frame: int, name: str, otherwise: Array) -> Array:
    """Return an array that the tracker stored for a frame; None in the init frame."""
    return np.asarray(arrays[frame][name], np.float64) if frame in arrays else otherwise


def _grey(values: Array) -> Image:
    """Convert a map in [0, 1] to a BGR image."""
    return np.repeat(np.round(255 * values).astype(np.uint8)[..., np.newaxis], 3, axis=2)
