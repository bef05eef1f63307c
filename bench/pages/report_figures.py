"""Figures that are written next to a page: its charts, curves of metrics and film strips."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from trackmark.bench.analysis.attribute_plot import plot_attributes
from trackmark.bench.analysis.by_annotation import MIN_AXES, AnnotationReport
from trackmark.bench.analysis.by_attribute import AttributeReport
from trackmark.bench.analysis.by_metrics import MetricScores
from trackmark.bench.analysis.film_strips import TRAJECTORY_LABELS, write_strips
from trackmark.bench.metrics import find_metrics
from trackmark.bench.metrics.interface import heading
from trackmark.bench.output_files import write_file
from trackmark.bench.pages.report import ReportPage
from trackmark.reports.charts import Chart, Line
from trackmark.reports.figures import add_legend, bare_figure, named_line, save_figure
from trackmark.reports.plots import chart_plot


def write_figures(
    page: ReportPage,
    folder: Path,
    title: str,
    suffix: str,
    on_message: Callable[[str], None],
    with_curves: Sequence[MetricScores] = (),
    by_attribute: Sequence[AttributeReport] = (),
    annotated: Sequence[AnnotationReport] = (),
) -> list[Path]:
    """Draw the charts of a page and all other figures into a folder; return the files.

    Plots have the format of `suffix`, such as `.png`; film strips are always PNG. `on_message` gets
    a message on each sequence and on metrics that cannot be drawn. `with_curves`, `by_attribute`
    and `annotated` are further scores that are drawn.
    """
    trackers = page.runs.trackers
    runs = [run for sequence in page.runs.sequences for run in sequence.one_pass]
    has_revised = any(run.revised is not None for run in runs)
    online = f"{title}, {TRAJECTORY_LABELS['online']}" if has_revised else title
    charts = (*page.curves, *page.speed, *page.survival)
    figures = {chart.figure: chart_plot(chart, online, trackers) for chart in charts}
    for scored in with_curves:
        figures |= metric_curves(scored, trackers, on_message)
    for table, measure, curves in by_attribute:
        if curves:
            figures[table.name] = plot_attributes(curves, measure, title)
    for report in annotated:
        if report.scores and len(report.headings) >= MIN_AXES:
            scores, headings = report.scores, report.headings
            figures[report.table.name] = _radar_plot(scores, headings, report.quantity, title)
    paths = [
        write_file(folder / f"{name}{suffix}", partial(save_figure, figure=figure))
        for name, figure in figures.items()
    ]
    return paths + write_strips(page.stored_runs, folder, on_message, trackers)


def metric_curves(
    scored: MetricScores, trackers: Sequence[str], on_message: Callable[[str], None]
) -> Mapping[str, Figure]:
    """Draw the curves of metrics."""
    if scored.curves and not any(scored.curves.values()):
        reason = f"there is no tracker all of whose runs {scored.metrics} can score."
        on_message(f"{scored.table.name}: no plot: {reason}")
        return {}
    figures = {}
    for name, axes in find_metrics(scored.metrics).curves.items():
        lines = [
            Line(tracker, position, *scored.curves[name][tracker].T)
            for position, tracker in enumerate(trackers)
            if tracker in scored.curves[name]
        ]
        chart = Chart("", *axes, lines, "", top=1.0)
        title = f"{scored.title}: {heading(name)}, metrics {scored.metrics}"
        file = f"{scored.table.name}-{name.replace('_', '-')}"
        figures[file] = chart_plot(chart, title, trackers)
    return figures


def _radar_plot(
    values: Mapping[str, Sequence[float]], headings: Sequence[str], quantity: str, title: str
) -> Figure:
    """Draw scores by attribute, from 0 in the centre to the best score at the edge.

    `values`: scores by tracker, in the order of `headings`; NaN leaves a gap.
    """
    figure = bare_figure(title, 6.5)
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    angles = np.linspace(0, 2 * np.pi, len(headings), endpoint=False)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_xticks(angles, headings, fontsize=9)
    axes.tick_params(axis="x", pad=12)
    axes.grid(alpha=0.3)
    for position, (label, scores) in enumerate(values.items()):
        axes.plot([*angles, angles[0]], [*scores, scores[0]], **named_line(label, position))
    axes.set_ylim(0)
    axes.tick_params(axis="y", labelsize=8)
    add_legend(figure, f"{quantity}; number of sequences in brackets")
    return figure
