"""Make tables and plots of stored results."""

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._imported_results import guests_of, guests_option, together
from trackmark.bench.commands._options import (
    json_option,
    metrics_option,
    patience,
    progress_bar,
)

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from numpy.typing import NDArray

    from trackmark.bench.pages.report import Commands
    from trackmark.bench.pages.report_figures import FigureFiles
    from trackmark.bench.reporting.by_attribute import AttributeReport
    from trackmark.bench.reporting.by_preset import PresetReport, Scored
    from trackmark.reports.tables import Table

TEXTS = ("text", "markdown", "csv", "latex")
FIGURES = ("png", "svg", "pdf")


@click.command("report")
@click.argument("results", type=click.Path(path_type=Path), required=False)
@click.option(
    "--format",
    "form",
    type=click.Choice(TEXTS + FIGURES),
    help="Print tables in this format alone; or have plots written so, which goes with --folder.",
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write the page, tables in every format, plots and film strips into this folder.  "
    "[default: the page alone, into RESULTS]",
)
@click.option("--frames", is_flag=True, help="Write frames of their own size beside the page.")
@guests_option
@click.option("--sequences", help="Of --results-of, where there are no RESULTS; as for `run`.")
@metrics_option
@click.option(
    "--by-attribute",
    is_flag=True,
    help="Add scores by attribute of the sequences (docs/attributes.md); measures these if needed.",
)
@click.option("--wide", is_flag=True, help="Print all columns, however wide the tables are.")
@click.option(
    "--no-pictures", is_flag=True, help="The tables that are printed alone: no page, no plots."
)
@json_option
def command(
    results: Path | None,
    form: str | None,
    folder: Path | None,
    frames: bool,
    results_of: tuple[str, ...],
    sequences: str | None,
    metrics: list[str],
    by_attribute: bool,
    wide: bool,
    no_pictures: bool,
    as_json: bool,
) -> int:
    """Report on RESULTS (the folder of an experiment, or one that holds several).

    Prints tables, and writes report.html, a page with a player of the frames; with --json or a
    --format of tables and no --folder it prints alone. Only RESULTS are read; film strips, the page
    and --by-attribute open the sequences, for their pixels. With --metrics stored runs are scored
    by other definitions; nothing is run again. With --results-of others' results on the same
    sequences stand in the same tables. Exit status 1 if every run of a tracker failed.
    """
    from trackmark.bench.reporting.tables import title_of
    from trackmark.bench.store.layout import experiment_folders
    from trackmark.reports.write import write_tables

    if results is None and not (results_of and sequences):
        raise click.UsageError("Give RESULTS, or --results-of and --sequences.")
    if results is not None and sequences is not None:
        raise click.UsageError("--sequences goes without RESULTS, whose sequences are known.")
    if as_json and form is not None:
        raise click.UsageError("--json and --format exclude each other.")
    if form in FIGURES and (folder is None or no_pictures):
        raise click.UsageError(f"--format {form} goes with --folder: plots are written into it.")
    paged = not no_pictures and (folder is not None or not (as_json or form))
    if frames and not paged:
        raise click.UsageError("--frames is of the page, which is not written: give --folder.")
    experiments = [] if results is None else experiment_folders(results)
    others = [text for path in results_of for text in ("--results-of", path)]
    others += [] if sequences is None else ["--sequences", sequences]
    with together(experiments, guests_of(results_of), sequences) as shown:
        for number, experiment in enumerate(shown):
            title = title_of(experiment, named=len(shown) > 1)
            made, scored = _tables(experiment, metrics, title)
            against = _against(experiment, metrics, made) if by_attribute else []
            kept = experiments[number] if experiments else None
            commands = _commands(kept, others)
            extra = _further(experiment, made, commands) if as_json else []
            _print(made + extra, form, wide=wide, as_json=as_json)
            target, files, figures = kept or Path("report"), list[Path](), None
            if folder is not None:
                target = folder / experiment.name if len(shown) > 1 else folder
                files += write_tables(target, made)
                if not no_pictures:
                    suffix = f".{form}" if form in FIGURES else ".png"
                    figures = _figure_files(suffix, scored, against)
            if paged:
                page = target / "report.html"
                files += _write_page(experiment, page, made, title, commands, frames, figures)
            _sum_up(files)
        return _tell_left_out(shown)


def _tell_left_out(experiments: Sequence[Path]) -> int:
    """Print a line on every tracker whose every run failed; return the exit status."""
    from trackmark.bench.reporting.failed_runs import failed_runs
    from trackmark.bench.store.loading import load_results

    lines = dict[str, None]()
    for experiment in experiments:
        for _, runs in load_results(experiment).groupby("protocol", sort=False, observed=True):
            failures = failed_runs(runs)
            lines |= {f"{name}: {failures.notes[name]}": None for name in failures.left_out}
    _tell(*lines)
    return EXIT_ANSWER_IS_NO if lines else 0


def _tell(*lines: str) -> None:
    for line in lines:
        click.echo(line, err=True)


def _sum_up(written: list[Path]) -> None:
    """Tell which file is to be opened first, and what lies beside it."""
    from trackmark.reports.write import what_was_written

    _tell(*what_was_written(written))


def _commands(results: Path | None, others: Sequence[str]) -> "Commands":
    """Return how the page names its results, and others' next to them, in commands."""
    from trackmark.bench.pages.report import Commands

    return Commands("" if results is None else str(results), others)


def _figure_files(
    suffix: str, scored: "list[Scored]", against: "list[AttributeReport]"
) -> "FigureFiles":
    """Return the figures that are written next to the page."""
    from trackmark.bench.pages.report_figures import FigureFiles

    return FigureFiles(suffix, _tell, scored, against)


def _against(experiment: Path, metrics: list[str], made: "list[Table]") -> "list[AttributeReport]":
    """Add and return tables of scores by attribute of the sequences, measured if needed."""
    from trackmark.bench.reporting.by_attribute import attribute_report, attributes_of

    def measured(runs: "pd.DataFrame", names: Sequence[str]) -> "dict[str, NDArray[np.float64]]":
        with progress_bar(None, "frame") as progress:
            return attributes_of(runs, names, progress, _tell)

    against = attribute_report(experiment, metrics, measured)
    made += [one.table for one in against]
    return against


def _tables(experiment: Path, metrics: list[str], title: str) -> "PresetReport":
    """Return tables of an experiment, and its runs as presets score them."""
    from trackmark.bench.reporting.by_preset import preset_report

    with patience("Scoring runs"):
        return preset_report(experiment, metrics, title=title)


def _further(experiment: Path, made: "list[Table]", commands: "Commands") -> "list[Table]":
    """Return all other tables of the page, whether it is written or not."""
    from trackmark.bench.pages.report import further_tables

    return further_tables(experiment, made, commands)


def _print(made: "list[Table]", form: str | None, *, wide: bool, as_json: bool) -> None:
    """Print the tables of an experiment: as JSON one a line."""
    from trackmark.reports.renderers import FORMATS as RENDERERS
    from trackmark.reports.renderers import to_json
    from trackmark.reports.table_width import on_terminal

    _, render = RENDERERS[form if form in TEXTS else "text"]
    if as_json:
        render = to_json
    elif form not in TEXTS and not wide:
        render = functools.partial(on_terminal, render=render, more=" (--wide)")
    click.echo("\n".join(map(render, made)))


def _write_page(
    experiment: Path,
    path: Path,
    made: "list[Table]",
    title: str,
    commands: "Commands",
    full: bool,
    figures: "FigureFiles | None",
) -> list[Path]:
    """Write the page and the figures next to it; return the files."""
    from trackmark.bench.pages.report import write_report_page
    from trackmark.bench.store.files import ResultsError

    try:
        with progress_bar(None, "frame") as progress:
            return write_report_page(
                experiment, path, made, title, commands, progress, full=full, figures=figures
            )
    except OSError as error:
        raise ResultsError(
            f"{error.filename}: {error.strerror}. Choose another folder with --folder, or write no "
            "page with --no-pictures."
        ) from error
