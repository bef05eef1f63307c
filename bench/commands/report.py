"""Write tables, plots and a page of stored results."""

import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._imported_results import (
    imported_runs,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    PATH,
    Command,
    json_option,
    layout_option,
    metrics_option,
    output_option,
    parse_published,
    published_option,
    quiet_option,
    results_of_option,
    sequences_option,
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
    from trackmark.bench.store.runs import Runs
    from trackmark.reports.tables import Table

TEXTS = ("text", "markdown", "csv", "latex")
FIGURES = ("png", "svg", "pdf")

NATIVE_TABLES = ("summary", "sequences", "times", "summary-revised", "sequences-revised")
"""Tables that the short table replaces, except with --verbose."""


@click.command("report", cls=Command)
@click.argument("results", required=False, type=PATH)
@output_option(
    "--format",
    "form",
    type=click.Choice(TEXTS + FIGURES),
    help="Format of the printed tables or, with --output, of the plots.",
)
@output_option(
    "--output",
    type=PATH,
    help="Write the page, tables in every format, plots and film strips to this folder.  "
    "[default: only the page, to RESULTS]",
)
@output_option(
    "--frames", "with_full_frames", is_flag=True, help="Write frames in full size next to the page."
)
@results_of_option
@sequences_option(
    help="Sequences of --results-of if RESULTS is not given; as for `run`.",
)
@layout_option
@metrics_option()
@published_option
@output_option(
    "--by-attribute",
    is_flag=True,
    help="Add scores by attribute of the sequences; see docs/attributes.md.",
)
@output_option("--verbose", is_flag=True, help="Print all tables with all columns.")
@output_option("--no-pictures", is_flag=True, help="Write tables only: no page, no plots.")
@output_option("--open", "opens_page", is_flag=True, help="Open the page in the browser.")
@json_option
@quiet_option
def command(
    results: Path | None,
    form: str | None,
    output: Path | None,
    with_full_frames: bool,
    results_of: tuple[str, ...],
    sequences: str | None,
    metrics: list[str],
    published: str | None,
    by_attribute: bool,
    verbose: bool,
    no_pictures: bool,
    opens_page: bool,
    as_json: bool,
    quiet: bool,
) -> int:
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
    from trackmark.bench.analysis.by_metrics import metric_tables
    from trackmark.bench.commands._table_files import list_written_files, write_tables
    from trackmark.bench.pages.report import ReportPage
    from trackmark.bench.store.database import ResultsError, experiment_folders

    has_page = not no_pictures and (output is not None or not (as_json or form))
    if results is None and not (results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences cannot be combined with RESULTS.")
    if as_json and form is not None:
        raise click.UsageError("--json and --format exclude each other. Give one.")
    if form in FIGURES and (output is None or no_pictures):
        raise click.UsageError(f"--format {form} is a format of plots. Give --output.")
    for option, is_given in (("--frames", with_full_frames), ("--open", opens_page)):
        if is_given and not has_page:
            raise click.UsageError(
                f"{option} requires a page, which is not written. Give --output."
            )
    if published is not None and not has_page:
        raise click.UsageError(
            "--published adds scores to a page, which is not written. Give --output."
        )
    published_scores = parse_published(published)
    imported = parse_imported(results_of)
    arguments = [part for argument in results_of for part in ("--results-of", argument)]
    arguments += [] if published is None else ["--published", published]
    arguments += [] if sequences is None else ["--sequences", sequences]
    if results is None:
        experiments = [imported_runs(imported, sequences or "")]
    else:
        experiments = [
            with_imported(open_runs(folder), imported) for folder in experiment_folders(results)
        ]
    for runs in experiments:
        title, target = runs.title, runs.folder or Path("report")
        if len(experiments) > 1 and title != target.name:
            title = f"{target.name}: {title}"
        with report_slow_work("Scoring runs"):
            tables, with_curves = metric_tables(runs, metrics, title)
        curves, annotated = _attribute_reports(runs, metrics) if by_attribute else ([], [])
        tables += [entry.table for entry in curves] + [entry.table for entry in annotated]
        heading = title if len(experiments) > 1 else ""
        _print_report(
            runs,
            tables,
            heading,
            metrics,
            form,
            published_scores,
            as_json=as_json,
            verbose=verbose,
            quiet=quiet,
        )
        print_corner_hints(runs)
        files, suffix = list[Path](), f".{form}" if form in FIGURES else ".png"
        if output is not None:
            target = output / target.name if len(experiments) > 1 else output
            files += write_tables(target, tables)
        if has_page:
            path = target / "report.html"
            with report_slow_work("Scoring runs"):
                page = ReportPage(runs, tables, arguments, published_scores)
            try:
                with progress_bar("Drawing the report", None, "frame") as progress:
                    files += page.write(path, title, progress, with_full_frames=with_full_frames)
                    if output is not None:
                        # Imports of Matplotlib and SciPy take longer than a page.
                        from trackmark.bench.pages.report_figures import write_figures

                        further_scores = with_curves, curves, annotated
                        files += write_figures(
                            page, target, title, suffix, print_message, *further_scores
                        )
            except OSError as error:
                raise ResultsError(
                    f"{error.filename}: {error.strerror}. Choose another folder with --output, or "
                    "write no page with --no-pictures."
                ) from error
            if opens_page and not webbrowser.open(path.absolute().as_uri()):
                print_message(f"No browser was found. Open {path} yourself.")
        for line in list_written_files(files):
            print_message(line)
    return _print_left_out(experiments)


def _attribute_reports(
    runs: "Runs", metrics: list[str]
) -> "tuple[list[AttributeReport], list[AnnotationReport]]":
    """Return scores by attribute of the sequences, measured and annotated."""
    from trackmark.bench.analysis.by_annotation import annotation_reports
    from trackmark.bench.analysis.by_attribute import attribute_report

    with progress_bar("Measuring attributes", None, "frame") as progress:
        curves = attribute_report(runs, metrics, progress, print_message)
    return curves, annotation_reports(runs, metrics)


def _print_report(
    runs: "Runs",
    tables: "list[Table]",
    heading: str,
    metrics: list[str],
    form: str | None,
    published: "Path | PublishedSet | None",
    *,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> None:
    """Print all tables in a form of text, or the answer, a short table and tables beyond it."""
    from trackmark.bench.analysis.run_summary import summarise
    from trackmark.reports.renderers import FORMATS, in_markdown, terminal_lines, to_json

    has_answer = not as_json and form not in ("text", "csv", "latex") and "native" in metrics
    summary = summarise(runs, published) if has_answer else None
    if as_json:
        rendered = [*map(to_json, tables)]
    elif form in TEXTS:
        if summary is not None:
            for sentence in (summary.sentences.heading, *summary.sentences.details):
                click.echo(f"{in_markdown(sentence)}\n")
        _, render = FORMATS[form]
        rendered = [*map(render, tables)]
    else:
        if heading:
            click.echo(f"{heading}:")
        if summary is not None:
            print_result(summary.lines(quiet=quiet))
            for warning in summary.warnings:
                print_event("warning", warning)
            if not verbose:
                tables = [table for table in tables if table.name not in NATIVE_TABLES]
            tables = [] if quiet else tables
            if tables:
                click.echo()
        rendered = [
            "\n".join([*terminal_lines(table, "--verbose", all_columns=verbose), ""])
            for table in tables
        ]
    if rendered:
        click.echo("\n".join(rendered))


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
