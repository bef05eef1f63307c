"""Write tables, plots and a page of stored results."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._imported_results import (
    imported_option,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    Command,
    ScreenOptions,
    argument,
    metrics_option,
    option,
    output_option,
    with_options,
)
from trackmark.bench.commands._progress import (
    patience,
    print_corner_hints,
    print_event,
    print_message,
    progress_bar,
)

if TYPE_CHECKING:
    from trackmark.bench.analysis.by_annotation import AnnotationReport
    from trackmark.bench.analysis.by_attribute import AttributeReport
    from trackmark.bench.pages.report import Commands
    from trackmark.bench.pages.report_figures import FigureFiles
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
        "Format of the printed tables or, with --folder, of the plots.",
        "--format",
        choices=TEXTS + FIGURES,
    )
    folder: Path | None = output_option(
        "Write the page, tables in every format, plots and film strips to this folder.  "
        "[default: only the page, to RESULTS]"
    )
    frames: bool = output_option("Write frames in full size next to the page.")
    results_of: tuple[str, ...] = imported_option()
    sequences: str | None = option(
        "Sequences of --results-of if RESULTS is not given; as for `run`.", metavar="SEQUENCES"
    )
    metrics: list[str] = metrics_option()
    by_attribute: bool = output_option(
        "Add scores by attribute of the sequences; see docs/attributes.md."
    )
    wide: bool = output_option("Print all tables with all columns.")
    no_pictures: bool = output_option("Write tables only: no page, no plots.")

    @property
    def has_page(self) -> bool:
        """True if a page is written."""
        return not self.no_pictures and (self.folder is not None or not (self.as_json or self.form))


@click.command("report", cls=Command)
@with_options(ReportOptions)
def command(options: ReportOptions) -> int:
    """Write tables, plots and a page of stored results.

    RESULTS is the results folder of an experiment, or a folder that contains several. The command
    prints an answer and a short table, and writes report.html, a page with all tables and a player
    of the frames. With --json or a text --format and without --folder, it prints all tables only.
    No tracker is run: --metrics scores stored runs by other presets, and --results-of adds results
    of other toolkits on the same sequences. Film strips, the page and --by-attribute read the
    frames of the sequences.

    For example:
      trackmark report results/windows
      trackmark report results/windows --metrics native,otb --folder paper --format pdf

    Exit codes: 0 success; 1 all runs of a tracker failed; 2 invalid usage or input; 130
    interrupted.
    """
    from trackmark.bench.store.layout import experiment_folders

    results, sequences = options.results, options.sequences
    if results is None and not (options.results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences cannot be combined with RESULTS.")
    if options.as_json and options.form is not None:
        raise click.UsageError("--json and --format exclude each other. Give one.")
    if options.form in FIGURES and (options.folder is None or options.no_pictures):
        raise click.UsageError(f"--format {options.form} is a format of plots. Give --folder.")
    if options.frames and not options.has_page:
        raise click.UsageError("--frames requires a page, which is not written. Give --folder.")
    stored = [] if results is None else experiment_folders(results)
    with with_imported(stored, parse_imported(options.results_of), sequences) as experiments:
        for number, experiment in enumerate(experiments):
            _report(experiment, stored[number] if stored else None, options, len(experiments) > 1)
        return _print_left_out(experiments)


def _report(experiment: Path, stored: Path | None, options: ReportOptions, several: bool) -> None:
    """Print and write the report on an experiment.

    `experiment`: folder with imported results. `stored`: folder of the stored results, if any.
    """
    from trackmark.bench.analysis.by_metrics import preset_report
    from trackmark.bench.analysis.run_tables import title_of
    from trackmark.bench.pages.report import Commands
    from trackmark.reports.write import list_written_files, write_tables

    metrics, folder = options.metrics, options.folder
    title = title_of(experiment, named=several)
    with patience("Scoring runs"):
        tables, scored = preset_report(experiment, metrics, title=title)
    curves = _curves(experiment, metrics, tables) if options.by_attribute else []
    annotated = _annotated(experiment, metrics, tables) if options.by_attribute else []
    arguments = [text for path in options.results_of for text in ("--results-of", path)]
    arguments += [] if options.sequences is None else ["--sequences", options.sequences]
    commands = Commands("" if stored is None else str(stored), arguments)
    if options.as_json or options.form in TEXTS:
        if options.form == "markdown":
            _print_answer(experiment, options)
        _print(tables, options)
    else:
        _print_summary(experiment, tables, options, title if several else "")
    print_corner_hints(experiment)
    target, files = stored or Path("report"), list[Path]()
    figures = None
    if folder is not None:
        # Imports of Matplotlib and SciPy's statistics take longer than a report on the terminal.
        from trackmark.bench.pages.report_figures import FigureFiles

        target = folder / experiment.name if several else folder
        files += write_tables(target, tables)
        suffix = f".{options.form}" if options.form in FIGURES else ".png"
        figures = FigureFiles(suffix, print_message, scored, curves, annotated)
    if options.has_page:
        page = target / "report.html"
        files += _write_page(experiment, page, tables, title, commands, options.frames, figures)
    for line in list_written_files(files):
        print_message(line)


def _curves(experiment: Path, metrics: list[str], tables: "list[Table]") -> "list[AttributeReport]":
    """Return scores by attribute of the sequences, and add their tables."""
    from trackmark.bench.analysis.by_attribute import attribute_report

    with progress_bar("Measuring attributes", None, "frame") as progress:
        curves = attribute_report(experiment, metrics, progress, print_message)
    tables += [curve.table for curve in curves]
    return curves


def _annotated(
    experiment: Path, metrics: list[str], tables: "list[Table]"
) -> "list[AnnotationReport]":
    """Return scores by annotated attribute, and add their tables."""
    from trackmark.bench.analysis.by_annotation import annotation_reports

    reports = annotation_reports(experiment, metrics)
    tables += [report.table for report in reports]
    return reports


def _print_summary(
    experiment: Path, tables: "list[Table]", options: ReportOptions, title: str
) -> None:
    """Print answer and short table; then tables of other presets, or all of them."""
    from trackmark.bench.analysis.run_summary import summarise

    summary = summarise(experiment) if "native" in options.metrics else None
    if title:
        click.echo(f"{title}:")
    if summary is not None:
        click.echo("\n".join(summary.lines(quiet=options.quiet)))
        for warning in summary.warnings:
            print_event("warning", warning)
    short = summary is not None and not (options.verbose or options.wide)
    further = [table for table in tables if not (short and table.name in NATIVE_TABLES)]
    if further and not (options.quiet and summary is not None):
        click.echo("" if summary is not None else None, nl=summary is not None)
        _print(further, options)


def _print_answer(experiment: Path, options: ReportOptions) -> None:
    """Print the answer as paragraphs of Markdown."""
    from trackmark.bench.analysis.run_summary import summarise
    from trackmark.reports.renderers import in_markdown

    summary = summarise(experiment) if "native" in options.metrics else None
    if summary is not None:
        for sentence in (summary.answer.heading, *summary.answer.details):
            click.echo(f"{in_markdown(sentence)}\n")


def _print(tables: "list[Table]", options: ReportOptions) -> None:
    """Print the tables of an experiment; as JSON one per line."""
    from trackmark.reports.renderers import FORMATS as RENDERERS
    from trackmark.reports.renderers import terminal_lines, to_json

    if options.as_json:
        texts = [*map(to_json, tables)]
    elif options.form in TEXTS or options.wide:
        _, render = RENDERERS[options.form if options.form in TEXTS else "text"]
        texts = [*map(render, tables)]
    else:
        texts = ["\n".join([*terminal_lines(table, "--wide"), ""]) for table in tables]
    if texts:
        click.echo("\n".join(texts))


def _write_page(
    experiment: Path,
    path: Path,
    tables: "list[Table]",
    title: str,
    commands: "Commands",
    full: bool,
    figures: "FigureFiles | None",
) -> list[Path]:
    """Write the page and return its files."""
    from trackmark.bench.pages.report import write_report_page
    from trackmark.bench.store.files import ResultsError

    try:
        with progress_bar("Drawing the report", None, "frame") as progress:
            return write_report_page(
                experiment, path, tables, title, commands, progress, full=full, figures=figures
            )
    except OSError as error:
        raise ResultsError(
            f"{error.filename}: {error.strerror}. Choose another folder with --folder, or write no "
            "page with --no-pictures."
        ) from error


def _print_left_out(experiments: Sequence[Path]) -> int:
    """Print a line per tracker whose runs all failed; return the exit code."""
    from trackmark.bench.analysis.failed_runs import failed_runs
    from trackmark.bench.store.data_frames import load_runs

    lines = dict[str, None]()
    for experiment in experiments:
        for _, runs in load_runs(experiment).groupby("protocol", sort=False):
            failures = failed_runs(runs)
            lines |= {f"{name}: {failures.notes[name]}": None for name in failures.left_out}
    for line in lines:
        print_message(line)
    return EXIT_NEGATIVE if lines else 0
