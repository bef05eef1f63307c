"""Figures that are written next to a page: its charts, heat map and film strips."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import heading
from trackmark.bench.pages.player_runs import PageRuns
from trackmark.bench.reporting.by_annotation import MIN_AXES, AnnotationReport
from trackmark.bench.reporting.by_attribute import AttributeReport, write_plot
from trackmark.bench.reporting.by_preset import PresetScores
from trackmark.bench.reporting.film_strips import TRACE_WORDS, write_strips
from trackmark.reports.figures import heat_plot, write_for_papers
from trackmark.reports.page.content import Chart, Line, Page
from trackmark.reports.plots import chart_plot, radar_plot


@dataclass(frozen=True)
class FigureFiles:
    """Requested figures.

    `suffix`: format, such as `.png`; film strips are PNG. `on_message`: called with a message on
    each sequence and preset that cannot be drawn. `scored`, `by_attribute`, `annotated`: scores of
    presets that are also drawn.
    """

    suffix: str
    on_message: Callable[[str], None]
    scored: Sequence[PresetScores] = ()
    by_attribute: Sequence[AttributeReport] = ()
    annotated: Sequence[AnnotationReport] = ()


def write_figures(
    experiment: Path,
    folder: Path,
    requested: FigureFiles,
    page: Page,
    runs: PageRuns,
) -> list[Path]:
    """Draw all figures that the data allow into a folder; return the files."""
    figures = dict(_charts(page, runs))
    for scored in requested.scored:
        figures |= preset_curves(scored, runs.trackers, requested.on_message)
    paths = [
        path
        for name, figure in figures.items()
        for path in write_for_papers(folder / f"{name}{requested.suffix}", figure)
    ]
    for table, measure, curves in requested.by_attribute:
        file = folder / f"{table.name}{requested.suffix}"
        paths += write_plot(file, curves, measure, page.title)
    for report in requested.annotated:
        if report.scores and len(report.heads) >= MIN_AXES:
            figure = radar_plot(report.scores, report.heads, report.quantity, page.title)
            paths += write_for_papers(folder / f"{report.table.name}{requested.suffix}", figure)
    return paths + write_strips(experiment, folder, requested.on_message, runs.trackers)


def _charts(page: Page, runs: PageRuns) -> Iterator[tuple[str, Figure]]:
    """Yield the charts of a page and its heat map by file name."""
    clips = [clip for stage in runs.stages for clip in stage.clips]
    revised = any(clip.take.revised is not None for clip in clips)
    online = f"{page.title}, {TRACE_WORDS['online']}" if revised else page.title
    for section in page.sections:
        for chart in section.charts:
            title = online if section.key == "curves" else page.title
            title = f"{chart.title}: {title}" if section.key == "timelines" else title
            yield chart.figure, chart_plot(chart, title, runs.trackers)
        for sheet in section.sheets:
            if sheet.heat:
                title = f"{page.title}: {sheet.table.caption}"
                rows = [row[0].text for row in sheet.table.rows]
                figure = heat_plot(sheet.values, rows, sheet.table.heads[1:], title)
                yield sheet.table.name, figure


def preset_curves(
    scored: PresetScores, trackers: Sequence[str], on_message: Callable[[str], None]
) -> Mapping[str, Figure]:
    """Draw the curves of a metrics preset."""
    if scored.curves and not any(scored.curves.values()):
        why = f"there is no tracker all of whose runs {scored.preset} can score."
        on_message(f"{scored.table.name}: no plot: {why}")
        return {}
    figures = {}
    for name, axes in metrics_preset(scored.preset).curves.items():
        lines = [
            _curve(tracker, position, scored.curves[name][tracker])
            for position, tracker in enumerate(trackers)
            if tracker in scored.curves[name]
        ]
        chart = Chart("", axes.x, axes.y, lines, "", top=1.0)
        title = f"{scored.title}: {heading(name)}, metrics preset {scored.preset}"
        file = f"{scored.table.name}-{name.replace('_', '-')}"
        figures[file] = chart_plot(chart, title, trackers)
    return figures


def _curve(tracker: str, position: int, points: NDArray[np.float64]) -> Line:
    return Line(tracker, position, points[:, 0], points[:, 1])
