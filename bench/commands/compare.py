"""Compare trackers pairwise on the same sequences."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.analysis import MARGINS
from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import execute_runs, plan_experiment, print_remarks
from trackmark.bench.commands._imported_results import (
    imported_runs,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    EXISTING_FILE,
    PATH,
    SPECIFICATION,
    Command,
    ExecutionOptions,
    FiniteRange,
    execution_options,
    input_option,
    layout_option,
    matching_sequences,
    metrics_option,
    name_option,
    option_group,
    output_option,
    parse_published,
    protocol_option,
    published_option,
    repetitions_option,
    results_of_option,
    screen_options,
    sequences_option,
    split_list,
)
from trackmark.bench.commands._output_files import check_outputs
from trackmark.bench.commands._progress import (
    open_runs,
    print_corner_hints,
    print_hint,
    print_message,
    report_slow_work,
)
from trackmark.bench.commands._terminal import print_result
from trackmark.bench.experiments.experiment import Experiment, default_name

if TYPE_CHECKING:
    import pandas as pd

    from trackmark.bench.analysis.comparison import Comparison
    from trackmark.reports.tables import ScoreMeasure


statistics_option = option_group("Statistics")


@click.command("compare", cls=Command)
@click.argument("trackers", nargs=-1, type=SPECIFICATION)
@sequences_option(
    help="Comma-separated names, paths or patterns with * and ?. Missing runs are executed.",
)
@layout_option
@input_option("--results", type=PATH, help="Results folder to compare.")
@results_of_option
@protocol_option
@published_option
@repetitions_option
@metrics_option(group="Statistics")
@statistics_option(
    "--metric",
    metavar="NAME",
    help=f"Score to compare: {', '.join(MARGINS)} of `native`, or a column of --metrics.  "
    "[default: mean_overlap, or the first score of the metrics]",
)
@statistics_option("--margin", type=FiniteRange(0), help="Equivalence margin.")
@statistics_option(
    "--against",
    metavar="NAME",
    type=SPECIFICATION,
    help="Compare only this tracker with every other tracker.",
)
@statistics_option(
    "--unit",
    type=click.Choice(["scene"]),
    help="Use scenes as units; results then hold for new scenes of these sequences only.",
)
@statistics_option(
    "--families",
    "family_file",
    type=EXISTING_FILE,
    help="CSV with sequence,family: sequences that count as one, such as clips of one video.",
)
@name_option(help="Name of the results folder; as in `run`.")
@output_option(
    "--output", type=PATH, help="Write tables, a figure and a paragraph for a paper to this folder."
)
@execution_options
@screen_options
def command(
    trackers: tuple[str, ...],
    sequences: str | None,
    results: Path | None,
    results_of: tuple[str, ...],
    protocol: str | None,
    published: str | None,
    repetitions: int | None,
    metrics: list[str],
    metric: str | None,
    margin: float | None,
    against: str | None,
    unit: str | None,
    family_file: Path | None,
    name: str | None,
    output: Path | None,
    options: ExecutionOptions,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Compare trackers pairwise on the same sequences.

    Give either --sequences (missing runs are executed) or --results (stored runs are compared; all
    trackers if none is named). The first tracker of each pair is reported as better, worse,
    equivalent or inconclusive. All pairs of up to four trackers are printed, all pairs of more
    trackers with --verbose. Each set of metrics gets its own comparison. Failed runs count as the
    worst score.

    For example:
      trackmark compare camshift opencv-mil --sequences 'samples/*' --repetitions 5
      trackmark compare --results results/windows --output paper

    Exit codes: 0 success; 1 all runs of a tracker failed, which is left out; 2 invalid usage or
    input, or a missing run in --results; 130 interrupted.
    """
    from trackmark.bench.analysis.comparison import compare_runs
    from trackmark.bench.analysis.comparison_tables import as_data, screen_lines
    from trackmark.bench.analysis.families import read_families
    from trackmark.bench.analysis.published_sets import PublishedSet
    from trackmark.bench.analysis.run_checks import AllFailedError
    from trackmark.bench.protocols import ONE_PASS, parse_protocol
    from trackmark.bench.store.database import single_experiment

    if (sequences is None) == (results is None):
        raise click.UsageError(
            "Give either --sequences or --results, for example --sequences 'samples/*'."
        )
    published_scores = parse_published(published)
    if isinstance(published_scores, Path) and published_scores.stem.startswith("comparison"):
        # The tables in --output are called comparison.csv and so on.
        written = output and output / published_scores.name
        check_outputs({"--output": written}, [published_scores])
    if family_file is not None and unit is not None:
        raise click.UsageError("Give either --families or --unit.")
    families = None if family_file is None else read_families(family_file)
    protocol_key = parse_protocol(protocol or ONE_PASS).key
    metrics = _metrics(metrics, protocol_key)
    if isinstance(published_scores, PublishedSet):
        metric = metric or published_scores.measure
        metrics = [published_scores.metrics] if _is_default("metrics") else metrics
    measures = {metric_set: _measure(metric_set, metric, margin) for metric_set in metrics}
    imported = parse_imported(results_of)
    imported_labels = [entry.tracker for entry in imported]
    specs = split_list(",".join(trackers))
    labels = [*map(_label, specs)]
    if against is not None and against not in imported_labels:
        against_spec, against = against, _label(against)
        if specs and against not in labels:
            specs, labels = [against_spec, *specs], [against, *labels]
    must_be_named = sequences is not None or (specs and published is None)
    if must_be_named and len(specs) + len(imported) < 2 - (published is not None):
        raise click.UsageError("Name at least two trackers to compare.")
    if results is not None:
        runs = with_imported(open_runs(single_experiment(results)), imported)
        _report_older_versions(runs.table[~runs.table["tracker"].isin(imported_labels)])
    elif specs:
        experiment = Experiment(
            name=name or default_name(specs, split_list(sequences or "")),
            trackers=tuple(specs),
            sequences=matching_sequences(sequences or "", trackers=specs),
            repetitions=repetitions or Experiment.repetitions,
            protocol=protocol or ONE_PASS,
        )
        execution = plan_experiment(experiment, options)
        print_remarks(execution)
        execute_runs(execution)
        print_hint(f"Runs are in {execution.folder}.")
        labels = [spec.label for spec in execution.plan.trackers.values()]
        runs = open_runs(execution.folder).select(execution.plan.requested)
        runs = with_imported(runs, imported)
    else:
        runs = imported_runs(imported, sequences or "")
    if labels:
        labels += imported_labels
        if set(labels) <= set(runs.table["tracker"].unique()):
            runs = runs.of_trackers(labels)  # runs of other trackers may be damaged
    compared = {}
    try:
        for metric_set, measure in measures.items():  # before any output: metrics can refuse runs
            with report_slow_work("Scoring runs"):
                compared[metric_set] = compare_runs(
                    runs,
                    metric_set,
                    measure,
                    labels or None,
                    against,
                    protocol=protocol_key,
                    published=published_scores,
                    by_scene=unit == "scene",
                    families=families,
                )
    except AllFailedError as error:
        print_message(str(error))
        return EXIT_NEGATIVE
    for metric_set, comparison in compared.items():
        if as_json:
            json_object = {"metrics": metric_set, **as_data(comparison)}
            click.echo(json.dumps(json_object, allow_nan=False))
        else:
            print_result(screen_lines(comparison, verbose=verbose, quiet=quiet))
        if output is not None:
            folder = output / metric_set if len(compared) > 1 else output
            print_message("\n".join(_write(comparison, folder)))
    first = next(iter(compared.values()))
    for label, note in first.failures.items():
        print_message(f"{label}: {note}")
    print_corner_hints(runs)
    return EXIT_NEGATIVE if first.left_out else 0


def _metrics(names: Sequence[str], protocol: str) -> list[str]:
    """Return the metrics; if `native` cannot score the runs, the protocol's own replace it."""
    from trackmark.bench.evaluation.scoring import can_score
    from trackmark.bench.protocols import parse_protocol

    replaced = {}
    if not can_score("native", protocol):
        replaced["native"] = parse_protocol(protocol).metrics
    return list(dict.fromkeys(replaced.get(name, name) for name in names))


def _is_default(parameter: str) -> bool:
    """Return whether the user has not given a parameter of the command."""
    source = click.get_current_context().get_parameter_source(parameter)
    return source is click.core.ParameterSource.DEFAULT


def _measure(metrics: str, metric: str | None, margin: float | None) -> "ScoreMeasure":
    """Return the score that is compared, with its margin."""
    from trackmark.bench.analysis.run_checks import ComparisonError, compared_measure

    try:
        return compared_measure(metrics, metric, margin)
    except ComparisonError as error:
        raise click.BadParameter(str(error), param_hint="--metric") from None


def _label(spec: str) -> str:
    """Return the label of a specification, which is its own label if there is no such tracker."""
    from trackmark.bench.experiments.tracker_spec import resolve_specs
    from trackmark.trackers import TrackerError

    try:
        return resolve_specs([spec])[spec].label
    except TrackerError:
        return spec  # stored runs can be compared without the tracker


def _report_older_versions(runs: "pd.DataFrame") -> None:
    """Print which trackers have stored runs of an outdated version."""
    from trackmark.bench.experiments.tracker_spec import built_in_digest

    stored_runs = runs.dropna(subset="tracker_version").astype(
        {"tracker": str, "tracker_name": str}
    )
    current = {name: built_in_digest(name) for name in stored_runs["tracker_name"].unique()}
    digests = stored_runs["tracker_name"].map(current)
    older = digests.notna() & (digests != stored_runs["tracker_version"].astype(str))
    for label, is_older in older.groupby(stored_runs["tracker"], sort=False):
        if count := int(is_older.sum()):
            print_message(
                f"{label}: {count} of {len(is_older)} stored runs are of another version of the "
                "tracker. Use --sequences to repeat them with the current version."
            )


def _write(comparison: "Comparison", folder: Path) -> list[str]:
    """Write tables, the figure and the paragraph; return lines that list the files."""
    from trackmark.bench.analysis.comparison_figures import write_differences
    from trackmark.bench.analysis.comparison_tables import files, paragraph
    from trackmark.bench.commands._table_files import list_written_files, write_tables
    from trackmark.bench.output_files import write_file

    paths = [*write_tables(folder, files(comparison)), *write_differences(comparison, folder)]
    file = folder / "paragraph.txt"
    paths.append(write_file(file, f"{paragraph(comparison)}\n"))
    return list_written_files(paths, file.name)
