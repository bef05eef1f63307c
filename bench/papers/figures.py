"""Figures of a paper: film strips, plots by frame and others, from `[figure]` in `paper.toml`.

A function of a paper that draws a figure takes a `Context`. It returns a Matplotlib figure, a BGR
image, a `Strip`, a mapping from file stems to these, or None.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.output_files import write_file
from trackmark.bench.papers import SETTING_LABELS
from trackmark.bench.papers.cases import PaperSequence, PaperTracker
from trackmark.bench.papers.measures import MeasuredRun, find_measure
from trackmark.bench.papers.paper import FigureDefinition
from trackmark.bench.papers.plots import series_plot
from trackmark.bench.papers.runs import Context
from trackmark.bench.papers.settings import differences, parameters
from trackmark.bench.papers.strips import BOTH, PAPER, Image, Note, Outline, Strip, StripRow
from trackmark.reports.figures import save_figure
from trackmark.reports.overlay import Shape, save_png
from trackmark.reports.tables import MISSING

Plot = Figure | Image | Strip

Runs = Mapping[str, MeasuredRun]
"""Runs of a tracker on a scene by the label of the setting."""


@dataclass(frozen=True)
class PaperFigure:
    """Figure that is drawn from our runs, as a PNG file or as a strip."""

    name: str  # stem of the file, such as `figure-3`
    label: str  # name in the paper, such as `Fig. 3`
    caption: str  # content of the paper's figure
    description: str  # content of our figure
    path: Path | None  # PNG file; None for strips
    strip: Strip | None = None


def draw_figures(context: Context) -> list[PaperFigure]:
    """Write the figures of a paper into the report's folder, in the order of `paper.toml`.

    A quick report contains the strips, and other figures that are marked as quick. Figures without
    runs are omitted.
    """
    figures = []
    for name, definition in context.paper.figure.items():
        if not definition.is_drawn(context.options.quick):
            continue
        description, drawn = definition.description, None
        if definition.function:
            drawn = definition.function(context)
        elif definition.frames:
            drawn = _strip(definition, context)
        else:
            description, drawn = _plot(definition, context)
        plots: Mapping[str, Plot | None] = drawn if isinstance(drawn, Mapping) else {name: drawn}
        for stem, plot in plots.items():
            label, caption = figure_label(stem), definition.caption_of(stem)
            if isinstance(plot, Strip):
                scene_description = f"{description} Scene {plot.scene}.".strip()
                figures.append(PaperFigure(stem, label, caption, scene_description, None, plot))
            elif plot is not None:
                path = _write(stem, plot, context)
                figures.append(PaperFigure(stem, label, caption, description, path))
    return figures


def figure_label(stem: str) -> str:
    """Return `Fig. 3, recommended` for `figure-3-recommended`."""
    _, number, *rest = stem.split("-")
    return ", ".join([f"Fig. {number}", *([" ".join(rest)] if rest else [])])


def _write(name: str, plot: Figure | Image, context: Context) -> Path:
    context.folder.mkdir(parents=True, exist_ok=True)
    path = context.folder / f"{name}.png"
    if isinstance(plot, Figure):
        return write_file(path, lambda file: save_figure(file, plot))
    return write_file(path, lambda file: save_png(file, plot))


def _strip(definition: FigureDefinition, context: Context) -> Strip | None:
    """Return the strip of the scene with the median error; None without runs."""
    assert definition.sequence is not None
    scene = median_scene(definition.trackers[0], definition.sequence, context)
    if not scene:
        return None
    frames = [number - context.paper.frames_from for number in definition.frames]
    columns = {
        frame: f"frame {number}" for frame, number in zip(frames, definition.frames, strict=True)
    }

    def write_notes(tracker: PaperTracker, runs: Runs, frame: int) -> list[Note]:
        states = definition.paper.get(tracker.name)
        return _notes(runs, frame, states[frames.index(frame)] if states else "")

    trackers, shape = definition.trackers, definition.shape
    return draw_strip(scene, trackers, columns, write_notes, context, shape)


def draw_strip(
    scene: str,
    trackers: Sequence[PaperTracker],
    columns: Mapping[int, str],
    write_notes: Callable[[PaperTracker, Runs, int], list[Note]],
    context: Context,
    shape: Shape = "box",
) -> Strip:
    """Return the strip of the scene with the median error of the first tracker, a row per tracker.

    `columns`: label of each frame. `write_notes`: returns the notes on the runs of a tracker, by
    setting label, in a frame.
    """
    sequence, rows, truth = datasets.load(scene), list[StripRow](), list[Outline]()
    images = [sequence[frame] for frame in columns]
    for tracker in trackers:
        runs = runs_by_setting(tracker, scene, context)
        boxes = [{label: run.boxes[frame] for label, run in runs.items()} for frame in columns]
        notes = [write_notes(tracker, runs, frame) for frame in columns]
        rows.append(StripRow(tracker.name, images, boxes, notes))
        truth = [next(iter(runs.values())).truth.boxes[frame] for frame in columns]
    selection = selection_sentence(scene, trackers[0].name)
    return Strip(selection, list(columns.values()), truth, rows, shape)


def selection_sentence(scene: str, tracker: str) -> str:
    """Return the specification of a scene with the reason why it is shown."""
    return f"`{scene}`, which has the median error of {tracker}, recommended"


def median_scene(tracker: PaperTracker, sequence: PaperSequence, context: Context) -> str:
    """Return the scene with the median error of the recommended tracker; empty without runs."""
    case = context.case(tracker, sequence, "recommended")
    values = context.runs.values(case, find_measure("mean_error", context.paper.name))
    ordered = values.sort_values("value", kind="stable")["scene"]
    return str(ordered.iloc[(len(ordered) - 1) // 2]) if len(ordered) else ""


def runs_by_setting(tracker: PaperTracker, scene: str, context: Context) -> Runs:
    """Return the run of each setting by its label; one run if the settings are equal."""
    specs = {label: tracker.spec(setting) for setting, label in SETTING_LABELS.items()}
    written, recommended = (parameters(spec) for spec in specs.values())
    if not differences(written, recommended):
        specs = {BOTH: specs.popitem()[1]}
    runs = {label: context.runs.measured_run(spec, scene) for label, spec in specs.items()}
    return {label: measured for label, measured in runs.items() if measured}


def _notes(runs: Runs, frame: int, paper: str) -> list[Note]:
    """Return the state of the target in a frame, in the paper and in our runs.

    `paper`: `tracked` or `lost` in the paper, or empty.
    """
    notes = [Note(PAPER, paper)] if paper else []
    for label, measured in runs.items():
        if not measured.present[frame]:
            notes.append(Note(label, MISSING))
            continue
        state = "tracked" if measured.on_target[frame] else "lost"
        tone = paper and ("good" if state == paper else "bad")
        notes.append(Note(label, f"{state} ({measured.error[frame]:.0f} px)", tone))
    return notes


def _plot(definition: FigureDefinition, context: Context) -> tuple[str, Figure | None]:
    """Draw a value by frame: one line per tracker, one panel per setting."""
    assert definition.sequence is not None
    panels: dict[str, dict[str, NDArray[np.float64]]] = {}
    for setting, label in SETTING_LABELS.items():
        for tracker in definition.trackers:
            case = context.case(tracker, definition.sequence, setting)
            runs = (context.runs.measured_run(case.tracker, s) for s in case.scenes_of_members)
            curves = [definition.quantity(measured) for measured in runs if measured]
            if curves:  # shorter scenes are padded with NaN
                panels.setdefault(label, {})[tracker.name] = pd.DataFrame(curves).to_numpy(float)
    if not panels:
        return "", None
    quantity, trackers = definition.axis_label, [tracker.name for tracker in definition.trackers]
    sequence = definition.sequence.name
    title = f"{sequence}: {quantity}"
    figure = series_plot(panels, title, quantity, trackers, context.paper.frames_from)
    description = (
        f"Curves of the {quantity} of {'; '.join(trackers)}: median and quartiles over "
        f"{context.n_scenes} scenes of {sequence}, one panel per setting."
    )
    return description, figure
