"""Figures of a paper: film strips, series and hooks, from the `[figure]` entries of `paper.toml`.

A hook is a function `(context)` that returns a Matplotlib figure, a strip (a BGR image), a mapping
from file stems to figures and strips, or None.
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
from trackmark.bench.claims.row_verdicts import SETTINGS
from trackmark.bench.papers.description import FigureEntry
from trackmark.bench.papers.measures import JudgedRun, find_measure, series
from trackmark.bench.papers.plan import scene_names, tracker_text
from trackmark.bench.papers.runs import Context
from trackmark.reports.figures import write_figure
from trackmark.reports.overlay import write_film_strip
from trackmark.reports.plots import series_plot

Image = NDArray[np.uint8]
Drawn = Figure | Image
Series = NDArray[np.float64]

QUANTITIES = {"error": "centre error [px]"}


@dataclass(frozen=True)
class Strip:
    """Frames of a scene with the run of each tracker and setting."""

    sequence: datasets.Sequence
    frames: list[int]  # from 0
    rows: list[tuple[str, str, JudgedRun]]  # tracker, setting and run


@dataclass(frozen=True)
class Drawing:
    """Figure as a PNG file or as a strip."""

    name: str  # stem of the file, such as `figure-3`
    label: str  # name in the paper, such as `Fig. 3`
    caption: str  # content of the paper's figure
    words: str  # content of our figure
    path: Path | None  # PNG file; None for strips, which only the HTML page shows
    entry: FigureEntry
    strip: Strip | None = None


def draw_figures(context: Context) -> list[Drawing]:
    """Write the figures of a paper into the report's folder, in the order of `paper.toml`.

    A quick report contains the strips and the hooks that are marked as quick. Figures without runs
    are omitted.
    """
    drawings = []
    for name, entry in context.description.figure.items():
        if not entry.is_drawn(context.effort.quick):
            continue
        if entry.kind == "strip":
            if strip := read_strip(entry, context):
                about = name, figure_label(name), entry.caption_of(name)
                words = (
                    f"Frames {', '.join(map(str, entry.frames))} of `{strip.sequence.name}`, the "
                    f"scene with the median error of {entry.trackers[0]} as recommended."
                )
                drawings.append(Drawing(*about, words, None, entry, strip))
        else:
            words, plots = _plots(name, entry, context)
            for stem, plot in plots.items():
                about = stem, figure_label(stem), entry.caption_of(stem)
                drawings.append(Drawing(*about, words, _write(stem, plot, context), entry))
    return drawings


def figure_label(name: str) -> str:
    """Return `Fig. 3, recommended` for `figure-3-recommended`; for other names, words."""
    number, _, rest = name.removeprefix("figure-").partition("-")
    if not re.fullmatch(r"figure-\d+\w?(-.*)?", name):
        return name.replace("-", " ").capitalize()
    return ", ".join(filter(None, [f"Fig. {number}", rest.replace("-", " ")]))


def _plots(name: str, entry: FigureEntry, context: Context) -> tuple[str, Mapping[str, Drawn]]:
    """Return the text about a figure and its plots by file stem."""
    if entry.kind == "series":
        words, drawn = _series(entry, context)
    else:
        words, drawn = entry.words, context.function(entry.hook)(context)
    plots = drawn if isinstance(drawn, Mapping) else {name: drawn}
    return words, {stem: plot for stem, plot in plots.items() if plot is not None}


def _write(name: str, plot: Drawn, context: Context) -> Path:
    context.folder.mkdir(parents=True, exist_ok=True)
    path = context.folder / f"{name}.png"
    if isinstance(plot, Figure):
        return write_figure(path, plot)
    return write_film_strip(path, plot)


def read_strip(entry: FigureEntry, context: Context) -> Strip | None:
    """Return the content of a strip: the scene with the median error; None without runs."""
    text = tracker_text(context.description, entry.trackers[0], "recommended")
    error = find_measure("mean_error", context.description.name)
    values = context.runs.values(text, entry.sequence, error, context.scenes)
    if values.empty:
        return None
    ordered = values.sort_values("value", kind="stable")["scene"]
    scene = str(ordered.iloc[(len(ordered) - 1) // 2])
    frames = [number - context.description.frames_from for number in entry.frames]
    rows = []
    for tracker in entry.trackers:
        texts = {name: tracker_text(context.description, tracker, name) for name in SETTINGS}
        if len(set(texts.values())) == 1:
            texts = {"both settings": texts[SETTINGS[0]]}
        for setting, text in texts.items():
            (judged, *_) = context.runs.judged_runs(text, scene)
            rows.append((tracker, setting.replace("-", " "), judged))
    return Strip(datasets.load(scene), frames, rows)


def _series(entry: FigureEntry, context: Context) -> tuple[str, Figure | None]:
    """Draw a value by frame: one line per tracker, one panel per setting."""
    by_frame = series(entry.of, context.description.name)
    quantity = entry.quantity or QUANTITIES.get(entry.of, entry.of)
    start = context.description.frames_from
    scenes = scene_names(context.description, entry.sequence, context.scenes)
    panels: dict[str, dict[str, Series]] = {}
    for setting in SETTINGS:
        for tracker in entry.trackers:
            text = tracker_text(context.description, tracker, setting)
            stored = (context.runs.judged_runs(text, name) for names in scenes for name in names)
            means = [np.mean([*map(by_frame, runs)], axis=0) for runs in stored if runs]
            if means:  # shorter scenes are padded with NaN
                rows = pd.DataFrame(means).to_numpy(float)
                panels.setdefault(setting.replace("-", " "), {})[tracker] = rows
    if not panels:
        return "", None
    trackers = list(entry.trackers)
    title = f"{entry.sequence}: {quantity}"
    plot = series_plot(panels, title, quantity, trackers, start)
    words = f"Curves of the {quantity} of {'; '.join(trackers)}: median and quartiles over "
    return f"{words}{len(scenes)} scenes of {entry.sequence}, one panel per setting.", plot
