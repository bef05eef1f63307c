"""Compare trackers pairwise on the same sequences."""

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.analysis import MARGINS
from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._execution import run_experiment
from trackmark.bench.commands._imported_results import (
    imported_option,
    parse_imported,
    with_imported,
)
from trackmark.bench.commands._options import (
    EXISTING_FILE,
    Command,
    EngineOptions,
    ScreenOptions,
    argument,
    matching_sequences,
    metrics_option,
    name_option,
    only_experiment,
    option,
    output_option,
    protocol_option,
    split_list,
    with_options,
)
from trackmark.bench.commands._output_files import check_outputs
from trackmark.bench.commands._progress import (
    patience,
    print_corner_hints,
    print_hint,
    print_message,
)
from trackmark.bench.experiments.experiment import Experiment, default_name

if TYPE_CHECKING:
    import pandas as pd

    from trackmark.bench.analysis.comparison import Comparison
    from trackmark.bench.analysis.families import Families
    from trackmark.bench.store.layout import RunKey
    from trackmark.reports.tables import ScoreMeasure


@dataclass(frozen=True, kw_only=True)
class CompareOptions(ScreenOptions, EngineOptions):
    """Options of the command."""

    trackers: tuple[str, ...] = argument(nargs=-1, required=False)
    sequences: str | None = option(
        "Comma-separated names, paths or patterns with * and ?. Missing runs are executed.",
        metavar="SEQUENCES",
    )
    results: Path | None = option("Results folder to compare.")
    results_of: tuple[str, ...] = imported_option()
    protocol: str | None = protocol_option()
    published: Path | None = option(
        "Published scores: CSV with tracker,sequence,METRIC.", type=EXISTING_FILE
    )
    seeds: int | None = option("Number of repetitions of stochastic trackers.", minimum=1)
    metrics: list[str] = metrics_option("Statistics")
    metric: str | None = option(
        f"Score to compare: {', '.join(MARGINS)} of `native`, or a column of --metrics.  "
        "[default: mean_overlap, or the first column of the preset]",
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
    folder: Path | None = output_option(
        "Write tables, a figure and a paragraph for a paper to this folder."
    )


@click.command("compare", cls=Command)
@with_options(CompareOptions)
def command(options: CompareOptions) -> int:
    """Compare trackers pairwise on the same sequences.

    Give either --sequences (missing runs are executed) or --results (stored runs are compared; all
    trackers if none is named). The first tracker of each pair is reported as better, worse,
    equivalent or inconclusive. All pairs of up to four trackers are printed, all pairs of more
    trackers with --verbose. Each metrics preset gets its own comparison. Failed runs count as the
    worst score.

    For example:
      trackmark compare camshift opencv-mil --sequences 'samples/*' --seeds 5
      trackmark compare --results results/windows --folder paper

    Exit codes: 0 success; 1 all runs of a tracker failed, which is left out; 2 invalid usage or
    input, or a missing run in --results; 130 interrupted.
    """
    from trackmark.bench.analysis.comparable_runs import AllFailedError
    from trackmark.bench.analysis.families import read_families
    from trackmark.bench.protocols import STORED_ONE_PASS, parse_protocol

    if (options.sequences is None) == (options.results is None):
        raise click.UsageError("Give either --sequences or --results.")
    if options.published is not None and options.published.stem.startswith("comparison"):
        # The tables in --folder are called comparison.csv and so on.
        written = options.folder and options.folder / options.published.name
        check_outputs({"--folder": written}, [options.published])
    if options.families is not None and options.unit is not None:
        raise click.UsageError("Give either --families or --unit.")
    families = None if options.families is None else read_families(options.families)
    filed = STORED_ONE_PASS if options.protocol is None else parse_protocol(options.protocol).text
    measures = {preset: _measure(preset, options) for preset in _presets(options.metrics, filed)}
    imported_trackers = parse_imported(options.results_of)
    imported = [entry.tracker for entry in imported_trackers]
    trackers, against = _trackers(options, imported)
    labels: list[str] | None = [label for label, _ in trackers] or None
    cells: Collection[RunKey] | None = None
    experiments = []
    must_be_named = options.sequences is not None or (trackers and options.published is None)
    if must_be_named and len(trackers) + len(imported) < 2:
        raise click.UsageError("Name at least two trackers to compare.")
    if options.results is not None:
        experiments = [only_experiment(options.results)]
    elif trackers:
        folder, labels, cells = _run(options, [text for _, text in trackers])
        experiments = [folder]
    only = None if cells is None else {sequence for _, sequence, _, _ in cells}
    with with_imported(experiments, imported_trackers, options.sequences, only) as (experiment,):
        runs = _load(experiment, labels, cells, imported, filed)
        if options.results is not None:
            _report_older_versions(runs.table[~runs.table["tracker"].isin(imported)])
        try:
            compared = {  # before any output: a preset can refuse the runs
                preset: _compare(runs, against, options, families, preset, measure)
                for preset, measure in measures.items()
            }
        except AllFailedError as error:
            print_message(str(error))
            return EXIT_NEGATIVE
        status = _report(compared, options)
        print_corner_hints(experiment, cells)
        return status


def _presets(metrics: Sequence[str], filed: str) -> list[str]:
    """Return the presets; if `native` cannot score the runs, the protocol's preset replaces it."""
    from trackmark.bench.analysis.run_tables import PRESET
    from trackmark.bench.evaluation.scoring import can_score
    from trackmark.bench.protocols import parse_protocol

    replaced = {} if can_score(PRESET, filed) else {PRESET: parse_protocol(filed).preset}
    return list(dict.fromkeys(replaced.get(name, name) for name in metrics))


def _measure(preset: str, options: CompareOptions) -> "ScoreMeasure":
    """Return the score that is compared, with its margin."""
    from trackmark.bench.analysis.comparable_runs import ComparisonError, compared_measure

    try:
        return compared_measure(preset, options.metric, options.margin)
    except ComparisonError as error:
        raise click.BadParameter(str(error), param_hint="--metric") from None


def _trackers(
    options: CompareOptions, imported: Sequence[str]
) -> tuple[list[tuple[str, str]], str | None]:
    """Return label and specification of each named tracker, and the label of --against.

    The tracker of --against is added to the named trackers.
    """
    trackers = [
        (label, text) for text in split_list(",".join(options.trackers)) for label in [_label(text)]
    ]
    if options.against is None or options.against in imported:
        return trackers, options.against
    against = _label(options.against)
    if trackers and against not in [label for label, _ in trackers]:
        trackers = [(against, options.against), *trackers]
    return trackers, against


def _label(text: str) -> str:
    """Return the label of a specification; the text itself if there is no such tracker."""
    from trackmark.bench.experiments.tracker_files import resolve_trackers
    from trackmark.trackers import TrackerError

    try:
        return resolve_trackers([text])[text].label
    except TrackerError:
        return text  # stored runs can be compared without the tracker


def _run(
    options: CompareOptions, trackers: Sequence[str]
) -> "tuple[Path, list[str], Collection[RunKey]]":
    """Execute missing runs; return the results folder, the labels and the requested runs."""
    sequences = options.sequences or ""
    experiment = Experiment(
        name=options.name or default_name(trackers, split_list(sequences), None),
        trackers=tuple(trackers),
        sequences=matching_sequences(sequences),
        repetitions=options.seeds or Experiment.repetitions,
        protocol=options.protocol or Experiment.protocol,
    )
    execution = run_experiment(experiment, options)
    print_hint(f"Runs are in {execution.folder}.")
    labels = [spec.label for spec in execution.plan.trackers.values()]
    return execution.folder, labels, execution.plan.manifest().versions


@dataclass(frozen=True)
class _Runs:
    """Runs of one experiment that are compared."""

    experiment: Path
    table: "pd.DataFrame"  # as `load_runs` returns them
    labels: list[str] | None  # labels of the compared trackers; None for all stored trackers
    filed: str  # protocol name under which runs are filed


def _load(
    experiment: Path,
    labels: list[str] | None,
    cells: "Collection[RunKey] | None",
    imported: Sequence[str],
    filed: str,
) -> _Runs:
    """Load requested runs (all stored runs if None), imported runs and timing runs."""
    from trackmark.bench.protocols import TIMING
    from trackmark.bench.store.data_frames import load_runs
    from trackmark.bench.store.results import Results

    if labels is not None:
        labels = [*labels, *imported]
    if cells is not None:
        stored = Results(experiment).manifest().versions if imported else ()
        cells = [*cells, *(cell for cell in stored if cell[0] in imported)]
        cells = [*cells, *((*cell[:3], TIMING) for cell in cells)]
    runs = load_runs(experiment, cells)
    if labels is not None and set(labels) <= set(runs["tracker"].unique()):
        runs = runs[runs["tracker"].isin(labels)]  # runs of other trackers may be damaged
    return _Runs(experiment, runs, labels, filed)


def _compare(
    runs: _Runs,
    against: str | None,
    options: CompareOptions,
    families: "Families | None",
    preset: str,
    measure: "ScoreMeasure",
) -> "Comparison":
    """Compare the runs by a score of a metrics preset."""
    from trackmark.bench.analysis.comparable_runs import same_boxes, scored_runs
    from trackmark.bench.analysis.comparison import compare
    from trackmark.bench.analysis.published_scores import with_published
    from trackmark.bench.analysis.run_tables import not_repeatable
    from trackmark.bench.store.truth import find_attributes

    labels = runs.labels
    with patience("Scoring runs"):
        table, measure = scored_runs(runs.experiment, runs.table, runs.filed, preset, measure)
    if options.published is not None:
        table, published = with_published(table, options.published, measure)
        labels = None if labels is None else [*labels, *published]
    finished = runs.table[runs.table["status"] == "finished"]
    return compare(
        table,
        measure,
        labels,
        against,
        by_scene=options.unit == "scene",
        families=families,
        attributes=find_attributes(runs.experiment, finished),
        same_boxes=same_boxes(runs.experiment, runs.table, runs.filed),
        not_repeatable=not_repeatable(runs.table),
    )


def _report_older_versions(runs: "pd.DataFrame") -> None:
    """Print which trackers have stored runs of an outdated version."""
    from trackmark.bench.experiments.tracker_spec import built_in_digest

    stored = runs.dropna(subset="tracker_version").astype({"tracker": str, "tracker_name": str})
    current = {name: built_in_digest(name) for name in stored["tracker_name"].unique()}
    digests = stored["tracker_name"].map(current)
    older = digests.notna() & (digests != stored["tracker_version"].astype(str))
    for label, is_older in older.groupby(stored["tracker"], sort=False):
        if count := int(is_older.sum()):
            print_message(
                f"{label}: {count} of {len(is_older)} stored runs are of another version of the "
                "tracker. Use --sequences to repeat them with the current version."
            )


def _report(compared: "dict[str, Comparison]", options: CompareOptions) -> int:
    """Print and write the comparisons by all presets; return the exit status."""
    from trackmark.bench.analysis.comparison_tables import as_data, screen_lines

    folder = options.folder
    for preset, comparison in compared.items():
        if options.as_json:
            data = {"metrics": preset, **as_data(comparison)}
            click.echo(json.dumps(data, allow_nan=False))
        else:
            lines = screen_lines(comparison, verbose=options.verbose, quiet=options.quiet)
            click.echo("\n".join(lines))
        if folder is not None:
            target = folder / preset if len(compared) > 1 else folder
            print_message("\n".join(_write(comparison, target)))
    first = next(iter(compared.values()))
    for tracker, note in first.failures.items():
        print_message(f"{tracker}: {note}")
    return EXIT_NEGATIVE if first.left_out else 0


def _write(comparison: "Comparison", folder: Path) -> list[str]:
    """Write tables, the figure and the paragraph; return lines that list the files."""
    from trackmark.bench.analysis.comparison_figures import write_differences
    from trackmark.bench.analysis.comparison_tables import files, paragraph
    from trackmark.reports.files import write_file
    from trackmark.reports.write import list_written_files, write_tables

    paths = [*write_tables(folder, files(comparison)), *write_differences(comparison, folder)]
    file = folder / "paragraph.txt"
    text = f"{paragraph(comparison)}\n"
    paths.append(write_file(file, lambda path: path.write_text(text, encoding="utf-8")))
    return list_written_files(paths, file.name)
