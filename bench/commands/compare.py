"""Compare trackers pairwise on the same sequences."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.analysis import MARGINS
from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import plan_and_execute
from trackmark.bench.commands._imported_results import (
    imported_option,
    imported_runs,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    EXISTING_FILE,
    Command,
    ExecutionOptions,
    ScreenOptions,
    argument,
    layout_option,
    matching_sequences,
    metrics_option,
    name_option,
    option,
    output_option,
    parse_published,
    protocol_option,
    published_option,
    split_list,
    with_options,
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
    from trackmark.bench.exchange.importing import ImportedTracker
    from trackmark.bench.store.runs import Runs
    from trackmark.reports.tables import ScoreMeasure


@dataclass(frozen=True, kw_only=True)
class CompareOptions(ScreenOptions, ExecutionOptions):
    """Options of the command."""

    trackers: tuple[str, ...] = argument(nargs=-1, required=False)
    sequences: str | None = option(
        "Comma-separated names, paths or patterns with * and ?. Missing runs are executed.",
        metavar="SEQUENCES",
    )
    layout: Path | None = layout_option()
    results: Path | None = option("Results folder to compare.")
    results_of: tuple[str, ...] = imported_option()
    protocol: str | None = protocol_option()
    published: str | None = published_option()
    repetitions: int | None = option("Number of repetitions of stochastic trackers.", minimum=1)
    metrics: list[str] = metrics_option("Statistics")
    metric: str | None = option(
        f"Score to compare: {', '.join(MARGINS)} of `native`, or a column of --metrics.  "
        "[default: mean_overlap, or the first score of the metrics]",
        group="Statistics",
        metavar="NAME",
    )
    margin: float | None = option("Equivalence margin.", group="Statistics", minimum=0)
    against: str | None = option(
        "Compare only this tracker with every other tracker.", group="Statistics", metavar="NAME"
    )
    unit: str | None = option(
        "Use scenes as units; results then hold for new scenes of these sequences only.",
        group="Statistics",
        choices=["scene"],
    )
    families: Path | None = option(
        "CSV with sequence,family: sequences that count as one, such as clips of one video.",
        group="Statistics",
        type=EXISTING_FILE,
    )
    name: str | None = name_option("Name of the results folder; as in `run`.")
    output: Path | None = output_option(
        "Write tables, a figure and a paragraph for a paper to this folder."
    )


@click.command("compare", cls=Command)
@with_options(CompareOptions)
def command(options: CompareOptions) -> int:
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
    from trackmark.bench.analysis.comparable_runs import AllFailedError
    from trackmark.bench.analysis.comparison import compare_runs
    from trackmark.bench.analysis.families import read_families
    from trackmark.bench.analysis.published_sets import PublishedSet
    from trackmark.bench.protocols import ONE_PASS, parse_protocol
    from trackmark.bench.store.keys import single_experiment

    if (options.sequences is None) == (options.results is None):
        raise click.UsageError("Give either --sequences or --results.")
    published = parse_published(options.published)
    if isinstance(published, Path) and published.stem.startswith("comparison"):
        # The tables in --output are called comparison.csv and so on.
        written = options.output and options.output / published.name
        check_outputs({"--output": written}, [published])
    if options.families is not None and options.unit is not None:
        raise click.UsageError("Give either --families or --unit.")
    families = None if options.families is None else read_families(options.families)
    protocol = ONE_PASS
    if options.protocol is not None:
        protocol = parse_protocol(options.protocol).key
    metrics = _metrics(options.metrics, protocol)
    metric = options.metric
    if isinstance(published, PublishedSet):
        metric = metric or published.measure
        metrics = [published.metrics] if _is_default("metrics") else metrics
    measures = {name: _measure(name, metric, options.margin) for name in metrics}
    imported_trackers = parse_imported(options.results_of)
    imported = [entry.tracker for entry in imported_trackers]
    trackers, against = _trackers(options, imported)
    labels: list[str] | None = [label for label, _ in trackers] or None
    must_be_named = options.sequences is not None or (trackers and options.published is None)
    if must_be_named and len(trackers) + len(imported) < 2 - (options.published is not None):
        raise click.UsageError("Name at least two trackers to compare.")
    if options.results is not None:
        runs = open_runs(single_experiment(options.results))
        if imported_trackers:
            runs = with_imported(runs, imported_trackers)
        _report_older_versions(runs.table[~runs.table["tracker"].isin(imported)])
    elif trackers:
        runs, labels = _run(options, [spec for _, spec in trackers], imported_trackers)
    else:
        runs = imported_runs(imported_trackers, options.sequences or "")
    if labels is not None:
        labels = [*labels, *imported]
        if set(labels) <= set(runs.table["tracker"].unique()):
            runs = runs.of_trackers(labels)  # runs of other trackers may be damaged
    compared = {}
    try:
        for name, measure in measures.items():  # before any output: metrics can refuse the runs
            with report_slow_work("Scoring runs"):
                compared[name] = compare_runs(
                    runs,
                    name,
                    measure,
                    labels,
                    against,
                    protocol=protocol,
                    published=published,
                    by_scene=options.unit == "scene",
                    families=families,
                )
    except AllFailedError as error:
        print_message(str(error))
        return EXIT_NEGATIVE
    status = _report(compared, options)
    print_corner_hints(runs)
    return status


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
    from trackmark.bench.analysis.comparable_runs import ComparisonError, compared_measure

    try:
        return compared_measure(metrics, metric, margin)
    except ComparisonError as error:
        raise click.BadParameter(str(error), param_hint="--metric") from None


def _trackers(
    options: CompareOptions, imported: Sequence[str]
) -> tuple[list[tuple[str, str]], str | None]:
    """Return label and specification of each named tracker, and the label of --against.

    The tracker of --against is added to the named trackers.
    """
    trackers = [(_label(spec), spec) for spec in split_list(",".join(options.trackers))]
    if options.against is None or options.against in imported:
        return trackers, options.against
    against = _label(options.against)
    if trackers and against not in [label for label, _ in trackers]:
        trackers = [(against, options.against), *trackers]
    return trackers, against


def _label(spec: str) -> str:
    """Return the label of a specification, which is its own label if there is no such tracker."""
    from trackmark.bench.experiments.tracker_spec import resolve_specs
    from trackmark.trackers import TrackerError

    try:
        return resolve_specs([spec])[spec].label
    except TrackerError:
        return spec  # stored runs can be compared without the tracker


def _run(
    options: CompareOptions, trackers: Sequence[str], imported: "Sequence[ImportedTracker]"
) -> "tuple[Runs, list[str]]":
    """Execute missing runs; return the requested and imported runs, and the labels of trackers."""
    sequences = options.sequences or ""
    experiment = Experiment(
        name=options.name or default_name(trackers, split_list(sequences), None),
        trackers=tuple(trackers),
        sequences=matching_sequences(sequences, trackers=trackers),
        repetitions=options.repetitions or Experiment.repetitions,
        protocol=options.protocol or Experiment.protocol,
    )
    execution = plan_and_execute(experiment, options)
    print_hint(f"Runs are in {execution.folder}.")
    requested = execution.plan.requested
    runs = open_runs(execution.folder).select(requested)
    if imported:
        runs = with_imported(runs, imported)
    return runs, [spec.label for spec in execution.plan.trackers.values()]


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


def _report(compared: "dict[str, Comparison]", options: CompareOptions) -> int:
    """Print and write the comparisons by all metrics; return the exit status."""
    from trackmark.bench.analysis.comparison_tables import as_data, screen_lines

    folder = options.output
    for metrics, comparison in compared.items():
        if options.as_json:
            json_object = {"metrics": metrics, **as_data(comparison)}
            click.echo(json.dumps(json_object, allow_nan=False))
        else:
            lines = screen_lines(comparison, verbose=options.verbose, quiet=options.quiet)
            print_result(lines)
        if folder is not None:
            target = folder / metrics if len(compared) > 1 else folder
            print_message("\n".join(_write(comparison, target)))
    first = next(iter(compared.values()))
    for tracker, note in first.failures.items():
        print_message(f"{tracker}: {note}")
    return EXIT_NEGATIVE if first.left_out else 0


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
