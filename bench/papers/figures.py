"""Figures of a paper as its `[figure]` entries say: film strips, numbers over frames, curves."""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.metrics.centre_error import centre_error
from bench.papers.context import Context
from bench.papers.description import FigureEntry
from bench.statistics.intervals import share_interval
from datasets.text_form import format_text, parse_text
from reports.curves import curve_plot
from reports.figures import write_figure
from reports.film_strip import film_strip, write_film_strip
from reports.overlay import TRUTH
from reports.palette import colours
from reports.series import REPETITIONS, series_grid

__all__ = ["Drawn", "caption_of", "draw_figure", "write_pictures"]

_NUMBERED = re.compile(r"figure-(\d+)")

Strip = NDArray[np.uint8]
Drawn = Figure | Strip | None


def draw_figure(entry: FigureEntry, context: Context) -> Drawn:
    """A figure as its entry (no hook) says; None where its runs are not there."""
    if entry.kind == "strip":
        return _strip(entry, context)
    return _frames(entry, context) if entry.kind == "frames" else _curve(entry, context)


def caption_of(name: str, plot: Drawn, entry: FigureEntry) -> tuple[str, str]:
    """See `bench.papers.Report.captions`; `name`: of a strip's file."""
    if not isinstance(plot, Figure):
        told = [f"Frames {_listed(entry.frames)} in columns"] if entry.frames else []
        told += [f"a row each for {_listed(entry.labels or entry.trackers)}"] * bool(entry.trackers)
        told += ["the truth's boxes beside"] * bool(told)
        words = entry.words or f"{'; '.join(told) or 'Frames, with boxes'}."
        return f"{name.replace('-', ' ').capitalize()}: {words[:1].lower()}{words[1:]}", ""
    axes = plot.axes
    x, y = (dict.fromkeys(getattr(one, f"get_{name}label")() for one in axes) for name in "xy")
    panels = dict.fromkeys(one.get_title() or one.get_title("left") for one in axes)
    legends = [*plot.legends, *filter(None, (one.get_legend() for one in axes))]
    named = dict.fromkeys(text.get_text() for legend in legends for text in legend.get_texts())
    over = _listed(x) or plot.get_supxlabel()
    told = [f"{_listed(y)} against {over}" if over and _listed(y) else _listed(y) or over]
    told += [f"panels: {_listed(panels)}"] if _listed(panels) else []
    told += [f"shown: {_listed(named)}"] if named else []
    words = "; ".join(filter(None, told))
    return _listed([plot.get_suptitle()]), f"{words[:1].upper()}{words[1:]}."


def _listed(texts: Iterable[object]) -> str:
    """Texts in a row, without their breaks."""
    return ", ".join(filter(None, (" ".join(str(text).split()) for text in texts)))


def _labelled(entry: FigureEntry, trackers: Sequence[str]) -> dict[str, str]:
    """Text forms by what the figure calls them."""
    return dict(zip(entry.labels or trackers, trackers, strict=True))


def _strip(entry: FigureEntry, context: Context) -> Strip | None:
    """Frames for each tracker, its boxes beside the truth's: first scene and run."""
    experiment, name = context.description.experiment(entry.experiments[0]), entry.sequences[0]
    runs: dict[str, Run] = {}
    for label, tracker in _labelled(entry, entry.trackers).items():
        found = context.stored.of(experiment, name, tracker)
        if found:
            runs[label] = found[0]
    if not runs:
        return None
    start = context.description.frames_from
    sequence, frames = datasets.load(name), [frame - start for frame in entry.frames]
    shades, columns = colours(list(runs)), entry.columns or len(frames)
    rows: list[Strip] = []
    for label, run in runs.items():
        truth = context.stored.truth(experiment, run).boxes
        errors = centre_error(truth, run.boxes)
        rows.append(
            film_strip(
                sequence.__getitem__,
                frames,
                {TRUTH: truth, label: run.boxes},
                "" if rows else f"{entry.title}, first repetition: frame (centre error)",
                columns,
                round(entry.enlarged * sequence[0].shape[1] * columns),
                shape=entry.shape,
                shades=shades,
                words={
                    frame: f"({errors[frame]:.1f} px)"
                    for frame in frames
                    if np.isfinite(errors[frame])
                },
                count_from=start,
            )
        )
    return np.vstack(rows)


def _frames(entry: FigureEntry, context: Context) -> Figure | None:
    """A series over frames: a row a panel; a column a sequence over its scenes, or a scene."""
    pieces: list[pd.DataFrame] = []
    truths: dict[str, NDArray[np.float64]] = {}
    shades: dict[str, dict[str, NDArray[np.bool_]]] = {}
    for experiment, sequence in zip(entry.experiments, entry.sequences, strict=True):
        name = context.description.experiment(experiment)
        for (panel, further), (label, tracker), (column, texts) in product(
            (entry.panels or {"": {}}).items(),
            _labelled(entry, entry.trackers).items(),
            _columns(entry, sequence, context.stored.sequences(name)).items(),
        ):
            parameters = {key: value for key, value in further.items() if key != "trace"}
            told = context.text_of(tracker, sequence, parameters)
            for place, text in enumerate(texts if told else ()):
                runs = context.stored.of(name, text, told or "")
                if not runs:
                    continue
                of = partial(
                    context.series,
                    truth=context.stored.truth(name, runs[0]),
                    sequence=sequence,
                    trace="revised" if further.get("trace") == "revised" else "online",
                )
                values = [of(entry.of, run) for run in runs]
                if entry.truth:
                    truths[column] = of(entry.truth, runs[0])
                shades[column] = {k: of(one, runs[0]) > 0 for k, one in entry.shades.items()}
                repeated = enumerate(values) if entry.scenes else [(place, np.mean(values, axis=0))]
                start = context.description.frames_from
                pieces += [
                    pd.DataFrame({"repetition": repetition, "value": value}).assign(
                        frame=np.arange(start, start + len(value)),
                        label=label,
                        reading=panel,
                        scene=column,
                    )
                    for repetition, value in repeated
                ]
    if not pieces:
        return None
    return series_grid(
        pd.concat(pieces, ignore_index=True),
        entry.title,
        entry.quantity,
        list(entry.labels or entry.trackers),
        truths,
        REPETITIONS if entry.scenes else "scenes",
        entry.height,
        shades=shades,
        level=next(iter(entry.level.items()), None),
    )


def _columns(entry: FigureEntry, sequence: str, there: Sequence[str]) -> dict[str, list[str]]:
    """Text forms of the scenes of a figure's columns, by what stands above these."""
    if entry.scenes:
        return {
            f"scene {scene}": [format_text(sequence, {"scene": scene} if scene else {})]
            for scene in entry.scenes
        }
    return {sequence.partition("/")[2]: [text for text in there if _is_of(text, sequence)]}


def _is_of(text: str, sequence: str) -> bool:
    """Whether a text form is that of one of a sequence's scenes."""
    name, options = parse_text(text)
    return (name, {k: v for k, v in options.items() if k != "scene"}) == parse_text(sequence)


def _curve(entry: FigureEntry, context: Context) -> Figure | None:
    """Draw the share of scenes in which a measure is so, across a parameter; a line a tracker."""
    points = []
    for panel, further in (entry.panels or {"": {}}).items():
        for label, tracker in _labelled(entry, entry.trackers).items():
            for sequence in entry.sequences:
                rows = context.across(tracker, sequence, further, entry.across)
                points += [
                    {"panel": panel, "label": label, "setting": number, **_share(runs, entry.of)}
                    for number, runs in rows.groupby(entry.across)
                ]
    if not points:
        return None
    return curve_plot(
        pd.DataFrame(points),
        entry.title,
        entry.across,
        entry.quantity,
        list(entry.labels or entry.trackers),
        heading="95 % intervals; a scene counts if more than half of its runs do",
        marks=entry.marks,
    )


def _share(runs: pd.DataFrame, measure: str) -> dict[str, float]:
    by_scene = runs.groupby("scene")[measure]
    good, trials = by_scene.sum(), by_scene.count()
    interval = share_interval(good, trials)
    return {"value": float((2 * good > trials).mean()), "low": interval.low, "high": interval.high}


def write_pictures(folder: Path, plots: Mapping[str, Drawn]) -> list[Path]:
    """Write plots and film strips as PNG into a folder, by their names; None is not written.

    They come in the order of the paper's numbers (`figure-<number>` and what comes after it), our
    own last.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, plot in plots.items():
        file = folder / f"{name}.png"
        if isinstance(plot, Figure):
            paths.append(write_figure(file, plot))
        elif plot is not None:
            paths.append(write_film_strip(file, plot))
    return sorted(paths, key=_place)


def _place(path: Path) -> tuple[bool, int, str]:
    found = _NUMBERED.match(path.stem)
    return found is None, int(found[1]) if found else 0, path.stem
