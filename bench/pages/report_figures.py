"""Figures that are written next to a page: its charts, curves of presets and film strips."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from trackmark.bench.analysis.by_annotation import MIN_AXES, AnnotationReport
from trackmark.bench.analysis.by_attribute import AttributeReport, plot_attributes
from trackmark.bench.analysis.by_metrics import PresetScores
from trackmark.bench.analysis.film_strips import TRACE_WORDS, write_strips
from trackmark.bench.metrics import preset as metrics_preset
from trackmark.bench.metrics.preset import heading
from trackmark.bench.pages.player_runs import PageRuns
from trackmark.reports.charts import Chart, Line
from trackmark.reports.figures import write_figure
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
    title: str,
    charts: Sequence[Chart],
    runs: PageRuns,
) -> list[Path]:
    """Draw the charts of a page and all other figures into a folder; return the files."""
    revised = [clip.take.revised for stage in runs.stages for clip in stage.clips]
    has_revised = any(boxes is not None for boxes in revised)
    online = f"{title}, {TRACE_WORDS['online']}" if has_revised else title
    figures = {chart.figure: chart_plot(chart, online, runs.trackers) for chart in charts}
    for scored in requested.scored:
        figures |= preset_curves(scored, runs.trackers, requested.on_message)
    for table, measure, curves in requested.by_attribute:
        if curves:
            figures[table.name] = plot_attributes(curves, measure, title)
    for report in requested.annotated:
        if report.scores and len(report.heads) >= MIN_AXES:
            scores, heads = report.scores, report.heads
            figures[report.table.name] = radar_plot(scores, heads, report.quantity, title)
    paths = [
        write_figure(folder / f"{name}{requested.suffix}", figure)
        for name, figure in figures.items()
    ]
    return paths + write_strips(experiment, folder, requested.on_message, runs.trackers)


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
            Line(tracker, position, *scored.curves[name][tracker].T)
            for position, tracker in enumerate(trackers)
            if tracker in scored.curves[name]
        ]
        chart = Chart("", axes.x, axes.y, lines, "", top=1.0)
        title = f"{scored.title}: {heading(name)}, metrics preset {scored.preset}"
        file = f"{scored.table.name}-{name.replace('_', '-')}"
        figures[file] = chart_plot(chart, title, trackers)
    return figures
