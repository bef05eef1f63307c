"""Write tables, plots and a page of stored results."""

import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._imported_results import (
    imported_option,
    imported_runs,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    Command,
    ScreenOptions,
    argument,
    layout_option,
    metrics_option,
    option,
    output_option,
    parse_published,
    published_option,
    with_options,
)
from trackmark.bench.commands._progress import (
    open_runs,
    print_corner_hints,
    print_event,
    print_message,
    progress_bar,
    report_slow_work,
)
from trackmark.bench.commands._terminal import print_result

if TYPE_CHECKING:
    from trackmark.bench.analysis.by_annotation import AnnotationReport
    from trackmark.bench.analysis.by_attribute import AttributeReport
    from trackmark.bench.analysis.published_sets import PublishedSet
    from trackmark.bench.pages.report import Commands
    from trackmark.bench.store.runs import Runs
    from trackmark.reports.tables import Table

TEXTS = ("text", "markdown", "csv", "latex")
FIGURES = ("png", "svg", "pdf")

NATIVE_TABLES = ("summary", "sequences", "times", "summary-revised", "sequences-revised")
"""Tables that the short table replaces, except with --verbose."""


@dataclass(frozen=True, kw_only=True)
class ReportOptions(ScreenOptions):
    """Options of the command."""

    results: Path | None = argument(required=False)
    form: str | None = output_option(
        "Format of the printed tables or, with --output, of the plots.",
        "--format",
        choices=TEXTS + FIGURES,
    )
    output: Path | None = output_option(
        "Write the page, tables in every format, plots and film strips to this folder.  "
        "[default: only the page, to RESULTS]"
    )
    with_full_frames: bool = output_option(
        "Write frames in full size next to the page.", "--frames"
    )
    results_of: tuple[str, ...] = imported_option()
    sequences: str | None = option(
        "Sequences of --results-of if RESULTS is not given; as for `run`.", metavar="SEQUENCES"
    )
    layout: Path | None = layout_option()
    metrics: list[str] = metrics_option()
    published: str | None = published_option()
    by_attribute: bool = output_option(
        "Add scores by attribute of the sequences; see docs/attributes.md."
    )
    verbose: bool = output_option("Print all tables with all columns.")
    no_pictures: bool = output_option("Write tables only: no page, no plots.")
    opens_page: bool = output_option("Open the page in the browser.", "--open")

    @property
    def has_page(self) -> bool:
        """True if a page is written."""
        return not self.no_pictures and (self.output is not None or not (self.as_json or self.form))


@click.command("report", cls=Command)
@with_options(ReportOptions)
def command(options: ReportOptions) -> int:
    """Write tables, plots and a page of stored results.

    RESULTS is the results folder of an experiment, or a folder that contains several. The command
    prints an answer and a short table, and writes report.html, a page with all tables and a player
    of the frames. With --json or a text --format and without --output, it prints all tables only.
    No tracker is run: --metrics scores stored runs by other presets, and --results-of adds results
    of other toolkits on the same sequences. Film strips, the page and --by-attribute read the
    frames of the sequences.

    For example:
      trackmark report results/windows
      trackmark report results/windows --metrics native,otb --output paper --format pdf

    Exit codes: 0 success; 1 all runs of a tracker failed; 2 invalid usage or input; 130
    interrupted.
    """
    from trackmark.bench.store.keys import experiment_folders

    results, sequences = options.results, options.sequences
    if results is None and not (options.results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences cannot be combined with RESULTS.")
    if options.as_json and options.form is not None:
        raise click.UsageError("--json and --format exclude each other. Give one.")
    if options.form in FIGURES and (options.output is None or options.no_pictures):
        raise click.UsageError(f"--format {options.form} is a format of plots. Give --output.")
    if options.with_full_frames and not options.has_page:
        raise click.UsageError("--frames requires a page, which is not written. Give --output.")
    if options.opens_page and not options.has_page:
        raise click.UsageError("--open requires a page, which is not written. Give --output.")
    if options.published is not None and not options.has_page:
        raise click.UsageError(
            "--published adds scores to a page, which is not written. Give --output."
        )
    published = parse_published(options.published)
    imported = parse_imported(options.results_of)
    if results is None:
        experiments = [imported_runs(imported, sequences or "")]
    else:
        experiments = [open_runs(folder) for folder in experiment_folders(results)]
        if imported:
            experiments = [with_imported(runs, imported) for runs in experiments]
    for runs in experiments:
        _report(runs, options, published, with_folder_name=len(experiments) > 1)
    return _print_left_out(experiments)


def _report(
    runs: "Runs",
    options: ReportOptions,
    published: "Path | PublishedSet | None",
    *,
    with_folder_name: bool,
) -> None:
    """Print and write the report on an experiment; captions name its folder if it is not alone."""
    from trackmark.bench.analysis.by_metrics import metric_tables
    from trackmark.bench.commands._table_files import list_written_files, write_tables
    from trackmark.bench.pages.report import Commands

    metrics, folder = options.metrics, options.output
    title = runs.title
    if with_folder_name and runs.folder is not None and title != runs.folder.name:
        title = f"{runs.folder.name}: {title}"
    with report_slow_work("Scoring runs"):
        tables, with_curves = metric_tables(runs, metrics, title)
    curves = _curves(runs, metrics, tables) if options.by_attribute else []
    annotated = _annotated(runs, metrics, tables) if options.by_attribute else []
    arguments = [text for path in options.results_of for text in ("--results-of", path)]
    arguments += [] if options.published is None else ["--published", options.published]
    arguments += [] if options.sequences is None else ["--sequences", options.sequences]
    commands = Commands("" if runs.folder is None else str(runs.folder), arguments)
    if options.as_json or options.form in TEXTS:
        if options.form == "markdown":
            _print_answer(runs, options, published)
        _print(tables, options)
    else:
        title_line = f"{title}:" if with_folder_name else ""
        _print_summary(runs, tables, options, published, title_line)
    print_corner_hints(runs)
    target, files = runs.folder or Path("report"), list[Path]()
    figures = None
    if folder is not None:
        # Imports of Matplotlib and SciPy's statistics take longer than a report on the terminal.
        from trackmark.bench.pages.report_figures import FigureFiles

        target = folder / target.name if with_folder_name else folder
        files += write_tables(target, tables)
        suffix = f".{options.form}" if options.form in FIGURES else ".png"
        figures = FigureFiles(suffix, print_message, with_curves, curves, annotated)
    if options.has_page:
        page = target / "report.html"
        options_of_page = {"with_full_frames": options.with_full_frames, "figures": figures}
        files += _write_page(
            runs, page, tables, title, commands, published=published, **options_of_page
        )
        if options.opens_page and not webbrowser.open(page.absolute().as_uri()):
            print_message(f"No browser was found. Open {page} yourself.")
    for line in list_written_files(files):
        print_message(line)


def _curves(runs: "Runs", metrics: list[str], tables: "list[Table]") -> "list[AttributeReport]":
    """Return scores by attribute of the sequences, and add their tables."""
    from trackmark.bench.analysis.by_attribute import attribute_report

    with progress_bar("Measuring attributes", None, "frame") as progress:
        curves = attribute_report(runs, metrics, progress, print_message)
    tables += [curve.table for curve in curves]
    return curves


def _annotated(runs: "Runs", metrics: list[str], tables: "list[Table]") -> "list[AnnotationReport]":
    """Return scores by annotated attribute, and add their tables."""
    from trackmark.bench.analysis.by_annotation import annotation_reports

    reports = annotation_reports(runs, metrics)
    tables += [report.table for report in reports]
    return reports


def _print_summary(
    runs: "Runs",
    tables: "list[Table]",
    options: ReportOptions,
    published: "Path | PublishedSet | None",
    title_line: str,
) -> None:
    """Print answer and short table; then tables of other metrics, or all of them."""
    from trackmark.bench.analysis.run_summary import summarise

    summary = summarise(runs, published) if "native" in options.metrics else None
    if title_line:
        click.echo(title_line)
    if summary is not None:
        print_result(summary.lines(quiet=options.quiet))
        for warning in summary.warnings:
            print_event("warning", warning)
    short = summary is not None and not options.verbose
    further = [table for table in tables if not (short and table.name in NATIVE_TABLES)]
    if further and not (options.quiet and summary is not None):
        click.echo("" if summary is not None else None, nl=summary is not None)
        _print(further, options)


def _print_answer(
    runs: "Runs", options: ReportOptions, published: "Path | PublishedSet | None"
) -> None:
    """Print the answer as paragraphs of Markdown."""
    from trackmark.bench.analysis.run_summary import summarise
    from trackmark.reports.renderers import in_markdown

    summary = summarise(runs, published) if "native" in options.metrics else None
    if summary is not None:
        for sentence in (summary.answer.heading, *summary.answer.details):
            click.echo(f"{in_markdown(sentence)}\n")


def _print(tables: "list[Table]", options: ReportOptions) -> None:
    """Print the tables of an experiment; as JSON one per line."""
    from trackmark.reports.renderers import FORMATS, terminal_lines, to_json

    if options.as_json:
        rendered = [*map(to_json, tables)]
    elif options.form in TEXTS:
        _, render = FORMATS[options.form]
        rendered = [*map(render, tables)]
    else:
        rendered = [
            "\n".join([*terminal_lines(table, "--verbose", all_columns=options.verbose), ""])
            for table in tables
        ]
    if rendered:
        click.echo("\n".join(rendered))


def _write_page(
    runs: "Runs",
    path: Path,
    tables: "list[Table]",
    title: str,
    commands: "Commands",
    **page_options: Any,
) -> list[Path]:
    """Write the page and return its files; for `page_options`, see `write_report_page`."""
    from trackmark.bench.pages.report import write_report_page
    from trackmark.bench.store.keys import ResultsError

    try:
        with progress_bar("Drawing the report", None, "frame") as progress:
            return write_report_page(runs, path, tables, title, commands, progress, **page_options)
    except OSError as error:
        raise ResultsError(
            f"{error.filename}: {error.strerror}. Choose another folder with --output, or write no "
            "page with --no-pictures."
        ) from error


def _print_left_out(experiments: "Sequence[Runs]") -> int:
    """Print a line per tracker whose runs all failed; return the exit code."""
    from trackmark.bench.analysis.score_tables import failed_runs

    lines = dict[str, None]()
    for runs in experiments:
        for _, rows in runs.table.groupby("protocol", sort=False):
            failures = failed_runs(rows)
            lines |= {f"{name}: {failures.notes[name]}": None for name in failures.left_out}
    for line in lines:
        print_message(line)
    return EXIT_NEGATIVE if lines else 0
