"""Comparison of trackers pair by pair, on stored or new runs."""

import functools
import json
import math
import textwrap
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO
from trackmark.bench.commands._imported_results import guests_of, guests_option, together
from trackmark.bench.commands._options import (
    chosen_sequences,
    engine_options,
    json_option,
    metrics_option,
    output_option,
    patience,
    progress_bar,
    protocol_option,
    refresh_index,
    split_list,
    telling_of_replaced,
)
from trackmark.bench.commands.run import ad_hoc_name
from trackmark.bench.experiments.experiment import Experiment
from trackmark.bench.reporting import MARGINS

if TYPE_CHECKING:
    from trackmark.bench.comparing.comparison import Comparison
    from trackmark.bench.store.layout import Cell
    from trackmark.reports.tables import Measure

WIDTH = 96

STRIPS = 3
"""Number of sequences drawn as film strips: those on which two trackers differ most."""

_HINT = "--metric"


@click.command("compare")
@click.argument("trackers", nargs=-1)
@click.option(
    "--sequences",
    help="Comma-separated names, paths or patterns with * and ?. Missing runs are executed.",
)
@click.option("--results", type=click.Path(path_type=Path), help="Results folder to compare.")
@guests_option
@protocol_option
@metrics_option
@click.option(
    "--metric",
    help=f"Score to compare: {', '.join(MARGINS)} of `native`, or a column of --metrics.  "
    "[default: mean_overlap, or the first column of the preset]",
)
@click.option("--margin", type=click.FloatRange(0), help="Equivalence margin.")
@click.option("--against", metavar="NAME", help="Compare this tracker with each other tracker.")
@click.option(
    "--unit",
    type=click.Choice(["scene"]),
    help="Use scenes as units; answers then hold for new scenes of these families only.",
)
@click.option("--seeds", type=click.IntRange(1), help="Repetitions of stochastic trackers.")
@click.option("--name", help="Name of the results folder; as in `run`.")
@click.option(
    "--published",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Published scores: CSV with tracker,sequence,METRIC.",
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write tables, figures and a paragraph for a paper to this folder.",
)
@output_option
@engine_options
@json_option
def command(
    trackers: tuple[str, ...],
    sequences: str | None,
    results: Path | None,
    results_of: tuple[str, ...],
    protocol: str | None,
    metrics: list[str],
    metric: str | None,
    margin: float | None,
    against: str | None,
    unit: str | None,
    seeds: int | None,
    name: str | None,
    published: Path | None,
    folder: Path | None,
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Compare TRACKERS pairwise on the same sequences.

    Give either --sequences (missing runs are executed) or --results (stored runs are compared; all
    trackers if none is named). The first tracker of each pair is reported as better, worse,
    equivalent or inconclusive. Each metrics preset gets its own comparison. Failed runs count as
    the worst score.

    Exit codes: 0 success; 1 every run of a tracker failed, which is left out; 2 invalid usage or
    input, or a missing run in --results; 130 interrupted.
    """
    if (sequences is None) == (results is None):
        raise click.UsageError("Give --sequences or --results (one of them).")
    if margin is not None and not math.isfinite(margin):
        raise click.UsageError("--margin must be a finite number.")
    stored = _stored(protocol)
    measures = {
        preset: _measure(preset, metric, margin)
        for preset in _presets(metrics or ["native"], stored)
    }
    guests = guests_of(results_of)
    imported = [guest.tracker for guest in guests]
    trackers = tuple(split_list(",".join(trackers)))
    trackers, against = _with_against(trackers, against, imported)
    labels = _labels(trackers)
    cells, experiments = None, []
    if sequences is not None and len(trackers) + len(guests) < 2:
        raise click.UsageError("Name the trackers to compare, two or more.")
    if sequences is not None and trackers:
        ran, labels, cells = _run(trackers, sequences, seeds, name, protocol, output, means)
        experiments = [ran]
    elif results is not None:
        experiments = [_only_experiment(results)]
    only = None if cells is None else {sequence for _, sequence, _, _ in cells}
    with together(experiments, guests, sequences, only) as (experiment,):
        selection = _Selection(
            experiment, labels, cells, imported, published, stored, against, unit == "scene"
        )
        return _compare(selection, measures, folder, as_json=as_json)


@dataclass(frozen=True)
class _Selection:
    """Runs and published scores that are compared."""

    experiment: Path
    labels: list[str] | None  # of trackers that ran here; None for all stored ones
    cells: "Collection[Cell] | None"  # runs of these trackers; None for all stored ones
    imported: list[str]  # labels of trackers with imported results
    published: Path | None
    stored: str  # protocol name under which runs are filed
    against: str | None  # label of the tracker that is compared with each other one
    by_scene: bool


def _stored(protocol: str | None) -> str:
    """Return the name under which runs by a protocol are filed."""
    from trackmark.bench.protocols import STORED_ONCE
    from trackmark.bench.protocols import protocol as protocol_of

    return STORED_ONCE if protocol is None else protocol_of(protocol).text


def _presets(metrics: Sequence[str], stored: str) -> list[str]:
    """Return the presets; instead of `native`, if it cannot judge the runs, the protocol's own."""
    from trackmark.bench.evaluation.scoring import can_judge
    from trackmark.bench.protocols import protocol as protocol_of
    from trackmark.bench.reporting.tables import PRESET

    replaced = {} if can_judge(PRESET, stored) else {PRESET: protocol_of(stored).preset}
    return list(dict.fromkeys(replaced.get(name, name) for name in metrics))


def _measure(preset: str, metric: str | None, margin: float | None) -> "Measure":
    """Return the score of a preset by which runs are compared, with its margin."""
    from trackmark.bench.reporting.tables import PRESET, SUMMARY

    if preset != PRESET:
        measure = _preset_measure(preset, metric, margin)
    else:
        measures = {measure.name: measure for measure in SUMMARY}
        name = metric or SUMMARY[0].name
        if name not in measures:
            raise click.BadParameter(
                f"{name!r} is not one of {', '.join(MARGINS)}.", param_hint=_HINT
            )
        measure = measures[name]
    return measure if margin is None else replace(measure, margin=margin)


def _preset_measure(preset: str, metric: str | None, margin: float | None) -> "Measure":
    """Return a column of a metrics preset as a measure with the margin of shares."""
    from trackmark.bench.metrics import preset as metrics_preset
    from trackmark.bench.metrics.preset import heading, mean_of_sequences
    from trackmark.reports.tables import Measure

    definitions = metrics_preset(preset)
    judging = {key: column for key, column in definitions.columns.items() if column.better}
    columns = {key: column for key, column in judging.items() if not column.whole}
    name = metric or next(iter(columns))
    if name not in columns:
        wrong = f"{preset} has no {name!r}"
        if name in judging:
            wrong = f"{name} is of all sequences together, and trackers are compared by sequence"
        raise click.BadParameter(
            f"{wrong}; of {preset} they can be compared by {', '.join(columns)}.", param_hint=_HINT
        )
    better = columns[name].better
    if margin is None and better == "lower":
        raise click.UsageError(f"{name} is not a share: give its equivalence --margin.")
    title = f"{heading(name)} ({preset})"
    if definitions.combine is not mean_of_sequences:  # `report` prints another number
        title = f"mean of sequences' {title}"
    return Measure(
        name,
        title,
        direction=better,
        decimals=3,
        least=0.0,
        most=1.0 if better == "higher" else math.inf,
        margin=MARGINS["mean_overlap"],
    )


def _compare(
    selection: _Selection, measures: "dict[str, Measure]", folder: Path | None, *, as_json: bool
) -> int:
    """Compare by all presets, show and write the comparisons, and return the exit status."""
    from trackmark.bench.comparing.comparable_runs import AllFailedError

    try:
        compared = {  # before any output: a preset may refuse the runs
            preset: _answers(selection, preset, measure) for preset, measure in measures.items()
        }
    except AllFailedError as error:
        click.echo(str(error), err=True)
        return EXIT_ANSWER_IS_NO
    for preset, answers in compared.items():
        _show(answers, preset, as_json=as_json)
        if folder is not None:
            target = folder / preset if len(measures) > 1 else folder
            click.echo("\n".join(_write(answers, selection.experiment, target)), err=True)
    answers = next(iter(compared.values()))
    for tracker, note in answers.failures.items():
        click.echo(f"{tracker}: {note}", err=True)
    return EXIT_ANSWER_IS_NO if answers.left_out else 0


def _answers(selection: _Selection, preset: str, measure: "Measure") -> "Comparison":
    """Compare the runs by a preset's score."""
    from trackmark.bench.comparing.comparable_runs import of_protocol, with_published
    from trackmark.bench.comparing.comparison import compare
    from trackmark.bench.comparing.stored_boxes import same_boxes
    from trackmark.bench.protocols import TIMING
    from trackmark.bench.reporting.by_preset import runs_by
    from trackmark.bench.reporting.failed_runs import with_worst_scores
    from trackmark.bench.reporting.tables import PRESET, not_repeatable
    from trackmark.bench.store.loading import load_results
    from trackmark.bench.store.results import Results
    from trackmark.bench.store.truth import occurring_attributes

    folder, labels, cells = selection.experiment, selection.labels, selection.cells
    if selection.imported:
        stored_cells = Results(folder).asked().cells
        imported = (cell for cell in stored_cells if cell[0] in selection.imported)
        cells = None if cells is None else [*cells, *imported]
        labels = None if labels is None else [*labels, *selection.imported]
    if cells is not None:
        cells = [*cells, *((*cell[:3], TIMING) for cell in cells)]
    runs = load_results(folder, cells)
    if labels is not None and set(labels) <= set(runs["tracker"].unique()):
        runs = runs[runs["tracker"].isin(labels)]  # other runs may be missing or damaged
    same, unrepeatable = same_boxes(folder, runs, selection.stored), not_repeatable(runs)
    attributes = occurring_attributes(folder, runs[runs["status"] == "finished"])
    if preset != PRESET:
        with patience("Scoring runs"):
            runs = runs_by(folder, preset, runs, selection.stored)
    runs = with_worst_scores(folder, runs, [preset])
    runs, measure = of_protocol(runs, selection.stored, measure)
    if selection.published is not None:
        runs, published = with_published(runs, selection.published, measure)
        labels = None if labels is None else [*labels, *published]
    return compare(
        runs,
        measure,
        labels,
        selection.against,
        by_scene=selection.by_scene,
        attributes=attributes,
        same_boxes=same,
        not_repeatable=unrepeatable,
    )


def _show(answers: "Comparison", preset: str, *, as_json: bool) -> None:
    """Print a comparison."""
    from trackmark.bench.comparing.summary_text import paragraph
    from trackmark.bench.comparing.tables import as_data, screen
    from trackmark.reports.printable import width
    from trackmark.reports.renderers import to_text
    from trackmark.reports.table_width import on_terminal

    if as_json:
        click.echo(json.dumps({"metrics": preset, **as_data(answers)}, allow_nan=False))
        return
    click.echo("\n".join(on_terminal(table, to_text) for table in screen(answers)))
    click.echo(textwrap.fill(paragraph(answers), min(WIDTH, width()), break_on_hyphens=False))


def _labels(trackers: tuple[str, ...]) -> list[str] | None:
    """Return the labels of trackers; a text that names no tracker is its own label."""
    from trackmark.bench.experiments.tracker_files import settled
    from trackmark.trackers import TrackerError

    labels = []
    for text in trackers:
        try:
            labels += [chosen.label for chosen in settled([text]).values()]
        except TrackerError:
            labels.append(text)  # the results may be stored without the tracker
    return labels or None


def _with_against(
    trackers: tuple[str, ...], against: str | None, imported: Sequence[str]
) -> tuple[tuple[str, ...], str | None]:
    """Return the trackers including that of --against, and its label."""
    if against is None or against in imported:
        return trackers, against
    labels = _labels((against,)) or [against]
    if len(labels) > 1:
        raise click.BadParameter(f"{against!r} names several trackers.", param_hint="--against")
    if trackers and labels[0] not in (_labels(trackers) or []):
        trackers = (against, *trackers)
    return trackers, labels[0]


def _only_experiment(results: Path | None) -> Path:
    """Return the only experiment in a results folder."""
    from trackmark.bench.store.layout import experiment_folders

    folders = experiment_folders(results or Path())
    if len(folders) > 1:
        names = ", ".join(path.name for path in folders)
        raise click.UsageError(f"{results} holds several experiments ({names}): name one.")
    return folders[0]


def _run(
    trackers: tuple[str, ...],
    sequences: str,
    seeds: int | None,
    name: str | None,
    protocol: str | None,
    output: Path,
    means: dict[str, Any],
) -> "tuple[Path, list[str], Collection[Cell]]":
    """Execute missing runs; return the experiment's folder, the labels and the requested runs."""
    from trackmark.bench.execution.executor import Execution
    from trackmark.datasets import SequenceError

    chosen = chosen_sequences(sequences, None)
    experiment = Experiment(
        name=name or ad_hoc_name(trackers, split_list(sequences), None),
        trackers=trackers,
        sequences=chosen,
        repetitions=seeds or Experiment.repetitions,
        protocol=protocol or Experiment.protocol,
    )
    refresh_index(output / experiment.name)
    execution = Execution(experiment, output, **means)
    with telling_of_replaced(execution), progress_bar(execution.work, "frame") as progress:
        for _ in execution.rows(progress):
            pass
    if execution.errors:
        raise SequenceError("\n".join(execution.errors))
    labels = [chosen.label for chosen in execution.plan.trackers.values()]
    return execution.folder, labels, execution.plan.asked().cells


def _write(answers: "Comparison", experiment: Path, folder: Path) -> list[str]:
    """Write tables, figures, film strips and the paragraph; return lines that list the files."""
    from trackmark.bench.comparing.figures import write_figures
    from trackmark.bench.comparing.summary_text import paragraph
    from trackmark.bench.comparing.tables import files
    from trackmark.bench.reporting.film_strips import write_strips
    from trackmark.reports.files import write_file
    from trackmark.reports.write import what_was_written, write_tables

    paths = [*write_tables(folder, files(answers)), *write_figures(answers, folder)]
    tell = functools.partial(click.echo, err=True)
    different = answers.most_different(STRIPS)
    paths += write_strips(experiment, folder, tell, list(answers.scores), different)
    words = folder / "paragraph.txt"
    text = f"{paragraph(answers)}\n"
    paths.append(write_file(words, lambda file: file.write_text(text, encoding="utf-8")))
    return what_was_written(paths, words.name)
