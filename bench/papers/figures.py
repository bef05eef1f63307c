"""Figures of a paper: film strips, plots by frame and others, from `[figure]` in `paper.toml`.

A function of a paper that draws a figure takes a `Context`. It returns a Matplotlib figure, a strip
(a BGR image), a mapping from file stems to figures and strips, or None.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.output_files import write_file
from trackmark.bench.papers import SETTING_LABELS
from trackmark.bench.papers.cases import Case, PaperTracker
from trackmark.bench.papers.measures import MeasuredRun, find_measure
from trackmark.bench.papers.paper import FigureDefinition
from trackmark.bench.papers.plots import series_plot
from trackmark.bench.papers.runs import Context
from trackmark.reports.figures import save_figure
from trackmark.reports.overlay import save_png

Image = NDArray[np.uint8]
Plot = Figure | Image


@dataclass(frozen=True)
class Strip:
    """Frames of a scene with the run of each tracker and setting."""

    sequence: datasets.Sequence
    frames: list[int]  # from 0
    rows: list[tuple[str, str, MeasuredRun]]  # tracker, setting and run


@dataclass(frozen=True)
class PaperFigure:
    """Figure that is drawn from our runs, as a PNG file or as a strip."""

    name: str  # stem of the file, such as `figure-3`
    label: str  # name in the paper, such as `Fig. 3`
    caption: str  # content of the paper's figure
    description: str  # content of our figure
    path: Path | None  # PNG file; None for strips, which only the HTML page shows
    definition: FigureDefinition
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
        description, plots = definition.description, dict[str, Plot | None]()
        if definition.kind == "strip":
            if strip := read_strip(definition, context):
                figures.append(_strip_figure(name, definition, strip))
        elif definition.kind == "plot":
            description, drawn_plot = _plot(definition, context)
            plots = {name: drawn_plot}
        elif definition.function:
            drawn = definition.function(context)
            plots = dict(drawn) if isinstance(drawn, Mapping) else {name: drawn}
        for stem, plot in plots.items():
            if plot is not None:
                path = _write(stem, plot, context)
                label, caption = figure_label(stem), definition.caption_of(stem)
                figures.append(PaperFigure(stem, label, caption, description, path, definition))
    return figures


def figure_label(name: str) -> str:
    """Return `Fig. 3, recommended` for `figure-3-recommended`; for other names, words."""
    number, _, rest = name.removeprefix("figure-").partition("-")
    if not re.fullmatch(r"figure-\d+\w?(-.*)?", name):
        return name.replace("-", " ").capitalize()
    return ", ".join(filter(None, [f"Fig. {number}", rest.replace("-", " ")]))


def _write(name: str, plot: Plot, context: Context) -> Path:
    context.folder.mkdir(parents=True, exist_ok=True)
    path = context.folder / f"{name}.png"
    if isinstance(plot, Figure):
        return write_file(path, lambda file: save_figure(file, plot))
    return write_file(path, lambda file: save_png(file, plot))


def _strip_figure(name: str, definition: FigureDefinition, strip: Strip) -> PaperFigure:
    description = (
        f"Frames {', '.join(map(str, definition.frames))} of `{strip.sequence.name}`, the "
        f"scene with the median error of {definition.trackers[0].name} as recommended."
    )
    label, caption = figure_label(name), definition.caption_of(name)
    return PaperFigure(name, label, caption, description, None, definition, strip)


def read_strip(definition: FigureDefinition, context: Context) -> Strip | None:
    """Return the content of a strip: the scene with the median error; None without runs."""
    case = _case(definition, definition.trackers[0], "recommended", context)
    values = context.runs.values(case, find_measure("mean_error", context.paper.name))
    if values.empty:
        return None
    ordered = values.sort_values("value", kind="stable")["scene"]
    scene = str(ordered.iloc[(len(ordered) - 1) // 2])
    frames = [number - context.paper.frames_from for number in definition.frames]
    rows = []
    for tracker in definition.trackers:
        specs = {label: tracker.spec(setting) for setting, label in SETTING_LABELS.items()}
        if len(set(specs.values())) == 1:
            specs = {"both settings": specs.popitem()[1]}
        for label, spec in specs.items():
            (measured, *_) = context.runs.measured_runs(spec, scene)
            rows.append((tracker.name, label, measured))
    return Strip(datasets.load(scene), frames, rows)


def _case(
    definition: FigureDefinition, tracker: PaperTracker, setting: str, context: Context
) -> Case:
    assert definition.sequence is not None
    return Case(tracker.spec(setting), definition.sequence, context.n_scenes)


def _plot(definition: FigureDefinition, context: Context) -> tuple[str, Figure | None]:
    """Draw a value by frame: one line per tracker, one panel per setting."""
    panels: dict[str, dict[str, NDArray[np.float64]]] = {}
    for setting, label in SETTING_LABELS.items():
        for tracker in definition.trackers:
            case = _case(definition, tracker, setting, context)
            runs_by_scene = (
                context.runs.measured_runs(case.tracker, s) for s in case.scenes_of_members
            )
            means = [
                np.mean([*map(definition.quantity, runs)], axis=0) for runs in runs_by_scene if runs
            ]
            if means:  # shorter scenes are padded with NaN
                panels.setdefault(label, {})[tracker.name] = pd.DataFrame(means).to_numpy(float)
    if not panels:
        return "", None
    quantity, trackers = definition.axis_label, [tracker.name for tracker in definition.trackers]
    sequence = definition.sequence.name if definition.sequence else ""
    title = f"{sequence}: {quantity}"
    figure = series_plot(panels, title, quantity, trackers, context.paper.frames_from)
    description = (
        f"Curves of the {quantity} of {'; '.join(trackers)}: median and quartiles over "
        f"{context.n_scenes} scenes of {sequence}, one panel per setting."
    )
    return description, figure
