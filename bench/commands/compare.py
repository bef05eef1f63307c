"""Compare trackers: which is better, by how much, and how surely."""

import functools
import json
import math
import textwrap
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands import EXIT_ANSWER_IS_NO
from bench.commands._guests import guests_of, guests_option, together
from bench.commands._options import (
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
from bench.commands.run import ad_hoc_name
from bench.experiments.experiment import Experiment
from bench.reporting import MARGINS

if TYPE_CHECKING:
    from bench.comparing.comparison import Comparison
    from bench.store.layout import Cell
    from reports.tables import Measure

__all__ = ["command"]

WIDTH = 96

STRIPS = 3
"""Sequences that are drawn as film strips: where two trackers differ most."""

_HINT = "--metric"


@click.command("compare")
@click.argument("trackers", nargs=-1)
@click.option("--sequences", help="Comma-separated names (with * and ?) or paths; runs what lacks.")
@click.option("--results", type=click.Path(path_type=Path), help="Compare what is stored there.")
@guests_option
@protocol_option
@metrics_option
@click.option(
    "--metric",
    help=f"Score to compare by: of native {', '.join(MARGINS)}; or a column of the --metrics.  "
    "[default: mean_overlap, or the first column]",
)
@click.option("--margin", type=click.FloatRange(0), help="Largest irrelevant difference.")
@click.option("--against", metavar="NAME", help="Compare this tracker with each other one only.")
@click.option(
    "--unit",
    type=click.Choice(["scene"]),
    help="Count scenes of several families: answers are for new scenes of these families only.",
)
@click.option("--seeds", type=click.IntRange(1), help="Repetitions of trackers that draw.")
@click.option("--name", help="Name of the results' folder; as `run` has it.")
@click.option(
    "--published",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="CSV tracker,sequence,METRIC of scores that others published.",
)
@click.option(
    "--folder",
    type=click.Path(path_type=Path),
    help="Write tables, figures and the paragraph here.",
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
    """Compare TRACKERS pair by pair on the same sequences.

    Either on --sequences, executing missing runs, or from --results alone (then all stored
    trackers, if none is named); with --results-of also others' results. Answers are better, worse,
    equivalent or inconclusive. Several --metrics give several comparisons. Failed runs count as the
    worst score.

    Exit status: 0 success; 1 every run of a tracker failed, which is left out; 2 wrong usage or
    input, or a missing run in --results.
    """
    if (sequences is None) == (results is None):
        raise click.UsageError("Give --sequences or --results (one of them).")
    if margin is not None and not math.isfinite(margin):
        raise click.UsageError("--margin is a finite number.")
    stored = _stored(protocol)
    measures = {
        preset: _measure(preset, metric, margin)
        for preset in _judging(metrics or ["native"], stored)
    }
    guests = guests_of(results_of)
    trackers = tuple(name for given in trackers for name in split_list(given))
    trackers, against = _with_against(trackers, against, [one.tracker for one in guests])
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
        others, scenes = [one.tracker for one in guests], unit == "scene"
        asked = _Asked(experiment, labels, cells, others, published, stored, against, scenes)
        return _compare(asked, measures, folder, as_json=as_json)


@dataclass(frozen=True)
class _Asked:
    """Which runs are compared: of an experiment, and scores that others published."""

    experiment: Path
    labels: list[str] | None  # of our trackers; None for all there
    cells: "Collection[Cell] | None"  # of our trackers; None for all there
    guests: list[str]  # labels of trackers whose results are others'
    published: Path | None
    stored: str  # the protocol by which they were made, as runs are filed under it
    against: str | None  # label of the tracker that is compared with each other one
    by_scene: bool


def _stored(protocol: str | None) -> str:
    """What runs by a protocol are filed under."""
    from bench.protocols import STORED_ONCE
    from bench.protocols import protocol as protocol_of

    return STORED_ONCE if protocol is None else protocol_of(protocol).text


def _judging(metrics: Sequence[str], stored: str) -> list[str]:
    """Presets that are asked for; for `native`, where it judges no such run, the protocol's own."""
    from bench.evaluation.scoring import can_judge
    from bench.protocols import protocol as protocol_of
    from bench.reporting.tables import PRESET

    own = protocol_of(stored).preset
    named = [own if name == PRESET and not can_judge(name, stored) else name for name in metrics]
    return list(dict.fromkeys(named))


def _measure(preset: str, metric: str | None, margin: float | None) -> "Measure":
    """Return the score of a preset by which runs are compared, with its margin."""
    from bench.reporting.tables import PRESET, SUMMARY

    if preset != PRESET:
        measure = _preset_measure(preset, metric, margin)
    else:
        measures = {measure.name: measure for measure in SUMMARY}
        name = metric or SUMMARY[0].name
        if name not in measures:
            raise click.BadParameter(f"{name!r} is none of {', '.join(MARGINS)}.", param_hint=_HINT)
        measure = measures[name]
    return measure if margin is None else replace(measure, margin=margin)


def _preset_measure(preset: str, metric: str | None, margin: float | None) -> "Measure":
    """Return a column of a metrics preset as a measure with the margin of shares."""
    from bench.metrics import preset as metrics_preset
    from bench.metrics.preset import heading, mean_of_sequences
    from reports.tables import Measure

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
        raise click.UsageError(f"{name} is no share: give the --margin that means nothing.")
    title = f"{heading(name)} ({preset})"
    if definitions.combine is not mean_of_sequences:  # then `report` prints another number
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
    asked: _Asked, measures: "dict[str, Measure]", folder: Path | None, *, as_json: bool
) -> int:
    """Compare by all presets, show and write the comparisons, and return the exit status."""
    from bench.comparing.comparable_runs import AllFailedError

    try:
        compared = {  # all of them before one is shown: a preset may refuse the runs
            preset: _answers(asked, preset, measure) for preset, measure in measures.items()
        }
    except AllFailedError as error:
        click.echo(str(error), err=True)
        return EXIT_ANSWER_IS_NO
    for preset, answers in compared.items():
        _show(answers, preset, as_json=as_json)
        if folder is not None:
            target = folder / preset if len(measures) > 1 else folder
            click.echo("\n".join(_write(answers, asked.experiment, target)), err=True)
    answers = next(iter(compared.values()))
    for tracker, note in answers.failures.items():
        click.echo(f"{tracker}: {note}", err=True)
    return EXIT_ANSWER_IS_NO if answers.left_out else 0


def _answers(asked: _Asked, preset: str, measure: "Measure") -> "Comparison":
    """Compare by a preset's score."""
    from bench.comparing.comparable_runs import of_protocol, with_published
    from bench.comparing.comparison import compare
    from bench.comparing.stored_boxes import same_boxes
    from bench.protocols import TIMING
    from bench.reporting.by_preset import runs_by
    from bench.reporting.failed_runs import with_worst_scores
    from bench.reporting.tables import PRESET, not_repeatable
    from bench.store.loading import load_results
    from bench.store.results import Results
    from bench.store.truth import occurring_attributes

    folder, labels, cells = asked.experiment, asked.labels, asked.cells
    if asked.guests:
        others = (one for one in Results(folder).asked().cells if one[0] in asked.guests)
        cells = None if cells is None else [*cells, *others]
        labels = None if labels is None else [*labels, *asked.guests]
    if cells is not None:
        cells = [*cells, *((*cell[:3], TIMING) for cell in cells)]
    runs = load_results(folder, cells)
    if labels is not None and set(labels) <= set(runs["tracker"].unique()):
        runs = runs[runs["tracker"].isin(labels)]  # others may be missing, or be damaged
    same, unrepeatable = same_boxes(folder, runs, asked.stored), not_repeatable(runs)
    attributes = occurring_attributes(folder, runs[runs["status"] == "finished"])
    if preset != PRESET:
        with patience("Scoring runs"):
            runs = runs_by(folder, preset, runs, asked.stored)
    runs = with_worst_scores(folder, runs, [preset])
    runs, measure = of_protocol(runs, asked.stored, measure)
    if asked.published is not None:
        runs, told = with_published(runs, asked.published, measure)
        labels = None if labels is None else [*labels, *told]
    return compare(
        runs,
        measure,
        labels,
        asked.against,
        by_scene=asked.by_scene,
        attributes=attributes,
        same_boxes=same,
        not_repeatable=unrepeatable,
    )


def _show(answers: "Comparison", preset: str, *, as_json: bool) -> None:
    """Print a comparison."""
    from bench.comparing.summary_text import paragraph
    from bench.comparing.tables import as_data, screen
    from reports.fitting import on_terminal
    from reports.printable import width
    from reports.renderers import to_text

    if as_json:
        click.echo(json.dumps({"metrics": preset, **as_data(answers)}, allow_nan=False))
        return
    click.echo("\n".join(on_terminal(one, to_text) for one in screen(answers)))
    click.echo(textwrap.fill(paragraph(answers), min(WIDTH, width()), break_on_hyphens=False))


def _labels(trackers: tuple[str, ...]) -> list[str] | None:
    """Labels of trackers as they were typed for `run`; what is none stands for itself."""
    from bench.experiments.outside import settled
    from trackers import TrackerError

    labels = []
    for text in trackers:
        try:
            labels += [chosen.label for chosen in settled([text]).values()]
        except TrackerError:
            labels.append(text)  # of results whose tracker is not here
    return labels or None


def _with_against(
    trackers: tuple[str, ...], against: str | None, guests: Sequence[str]
) -> tuple[tuple[str, ...], str | None]:
    """Return the trackers with the one that others are compared with, and that one's label."""
    if against is None or against in guests:
        return trackers, against
    labels = _labels((against,)) or [against]
    if len(labels) > 1:
        raise click.BadParameter(f"{against!r} names several trackers.", param_hint="--against")
    if trackers and labels[0] not in (_labels(trackers) or []):
        trackers = (against, *trackers)
    return trackers, labels[0]


def _only_experiment(results: Path | None) -> Path:
    """The experiment in a folder of results, its index up to date."""
    from bench.store.layout import experiment_folders

    found = experiment_folders(results or Path())
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise click.UsageError(f"{results} holds several experiments ({names}): name one.")
    refresh_index(found[0])
    return found[0]


def _run(
    trackers: tuple[str, ...],
    sequences: str,
    seeds: int | None,
    name: str | None,
    protocol: str | None,
    output: Path,
    means: dict[str, Any],
) -> "tuple[Path, list[str], Collection[Cell]]":
    """Run what is not there yet; give the experiment's folder, the labels and the runs meant."""
    from bench.execution.run import Execution
    from datasets import SequenceError

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
    """Write tables in every format, figures, film strips where trackers differ, the paragraph.

    Gives lines that say what was written.
    """
    from bench.comparing.figures import write_figures
    from bench.comparing.summary_text import paragraph
    from bench.comparing.tables import files
    from bench.reporting.pictures import write_strips
    from reports.files import write_file
    from reports.write import what_was_written, write_tables

    paths = [*write_tables(folder, files(answers)), *write_figures(answers, folder)]
    tell = functools.partial(click.echo, err=True)
    different = answers.most_different(STRIPS)
    paths += write_strips(experiment, folder, tell, different, list(answers.scores))
    words = folder / "paragraph.txt"
    text = f"{paragraph(answers)}\n"
    paths.append(write_file(words, lambda file: file.write_text(text, encoding="utf-8")))
    return what_was_written(paths, words.name)
