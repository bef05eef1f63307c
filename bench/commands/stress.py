"""Find the level of a difficulty at which half of the runs survive."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands._execution import execute_runs, plan_experiment
from trackmark.bench.commands._options import (
    PATH,
    SPECIFICATION,
    Command,
    ExecutionOptions,
    IntegerRange,
    execution_options,
    input_option,
    matching_sequences,
    name_option,
    output_option,
    screen_options,
    sequences_option,
    split_list,
)
from trackmark.bench.commands._progress import (
    RunProgress,
    open_runs,
    print_corner_hints,
    print_message,
)
from trackmark.bench.commands._terminal import print_result
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec

if TYPE_CHECKING:
    import pandas as pd

    from trackmark.bench.execution.plan import OpenedSequences
    from trackmark.bench.stress.breaking_points import StressTest


@click.command("stress", cls=Command)
@click.argument("trackers", nargs=-1, required=True, type=SPECIFICATION)
@input_option(
    "--difficulty",
    "difficulties",
    required=True,
    metavar="NAMES",
    help="Comma-separated filters (noise, blur, gain, size, motion, step, occlusion, similarity, "
    "box_error) or parameters of the scenes; NAME=FROM..TO sets the range, from easy to hard.",
)
@sequences_option(
    default="plain/target",
    help="Comma-separated names, paths or patterns; scenes vary unless one is named.",
)
@input_option(
    "--runs",
    "max_runs",
    type=IntegerRange(20),
    default=100,
    help="Maximum number of runs per tracker and difficulty.",
)
@input_option(
    "--against",
    metavar="TEXT",
    type=SPECIFICATION,
    default="camshift",
    help="Tracker by whose breaking points the others are divided.",
)
@name_option(default="stress")
@output_option("--output", type=PATH, help="Write tables, curves and all runs to this folder.")
@execution_options
@screen_options
def command(
    trackers: tuple[str, ...],
    difficulties: str,
    sequences: str,
    max_runs: int,
    against: str,
    name: str,
    output: Path | None,
    options: ExecutionOptions,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Find the level of a difficulty at which half of the runs survive.

    Each difficulty is increased until the trackers lose the target. Most runs are made at levels
    near the breaking point, at which half of the runs survive. Stored runs are not repeated. See
    docs/stress.md.

    For example:
      trackmark stress multipart --difficulty noise,occlusion
      trackmark stress matcher.py --difficulty speed=2..8 --sequences plain/target --output out

    Exit codes: 0 success; 2 invalid usage or input; 130 interrupted.
    """
    from trackmark.bench.commands._table_files import list_written_files, write_tables
    from trackmark.bench.experiments.tracker_spec import resolve_specs
    from trackmark.bench.stress.breaking_points import (
        BreakingPoints,
        RunSequences,
        StressTest,
        breaking_point_lines,
        parse_difficulty,
        stress_json,
        stress_tables,
        write_curves,
    )
    from trackmark.reports.renderers import terminal_lines

    if not (listed := split_list(difficulties)):
        raise click.UsageError("--difficulty: the list is empty. Name at least one.")
    resolved = resolve_specs(split_list(",".join([*trackers, against])))
    specs = {tracker.label: spec for spec, tracker in resolved.items()}
    run_sequences = RunSequences([source.spec for source in matching_sequences(sequences)])
    # Names that are given twice with the same range are one difficulty.
    parsed = dict.fromkeys(parse_difficulty(item, run_sequences.sequences) for item in listed)
    if len({difficulty.name for difficulty in parsed}) < len(parsed):
        raise click.UsageError(
            "--difficulty: a name is given twice, with different ranges. Give each name once."
        )
    stress_tests = [
        StressTest(label, difficulty, run_sequences, max_runs)
        for difficulty in parsed
        for label in specs
    ]
    folder = options.results_root / name
    title = f"{name}: {len(specs)} trackers, {', '.join(entry.name for entry in parsed)}"
    with RunProgress(title, folder) as progress:
        stress_tests = _complete_tests(_Runner(name, options, progress, specs), stress_tests)
    result = BreakingPoints(stress_tests, resolved[against].label)
    if as_json:
        click.echo(json.dumps(stress_json(result), allow_nan=False))
    else:
        print_result(breaking_point_lines(result))
        if not quiet:
            for table in stress_tables(result):
                click.echo("\n".join(["", *terminal_lines(table, "--output")]))
    print_corner_hints(open_runs(folder))
    if output is not None:
        paths = [
            *write_tables(output, stress_tables(result, with_runs=True)),
            *write_curves(result, output),
        ]
        print_message("\n".join(list_written_files(paths)))
    return 0


@dataclass
class _Runner:
    """Executor of the runs of the command."""

    name: str  # name of the results folder
    options: ExecutionOptions
    progress: RunProgress
    specs: Mapping[str, str]  # specifications of the trackers, by label
    opened_sequences: "OpenedSequences" = field(default_factory=dict)

    def run(
        self, labels: Sequence[str], sequences: Sequence[str]
    ) -> "tuple[pd.DataFrame, dict[str, str]]":
        """Execute missing runs; return all runs, and the specifications of sequences by name."""
        from trackmark.bench.store.runs import Runs
        from trackmark.datasets.interface import SequenceError, UnusableSequencesError

        experiment = Experiment(
            self.name,
            tuple(self.specs[label] for label in labels),
            tuple(map(SequenceSpec, sequences)),
            title="Breaking points",
        )
        try:
            execution = plan_experiment(
                experiment, self.options, opened_sequences=self.opened_sequences
            )
            self.progress.expect(execution)
            execute_runs(execution, progress=self.progress)
        except UnusableSequencesError as error:  # the user did not choose each of them
            raise SequenceError(next(iter(error.errors.values()))) from None
        specs = {sequence.name: sequence.source.spec for sequence in execution.plan.sequences}
        runs = Runs.open(execution.folder).select(execution.plan.requested)
        return runs.table, specs


def _complete_tests(runner: _Runner, stress_tests: "Sequence[StressTest]") -> "list[StressTest]":
    """Return the completed stress tests; in each round, every one gets a batch of runs.

    Trackers whose next runs use the same sequences share an execution.
    """
    current = list(stress_tests)
    while any(test.next_runs() for test in current):
        labels_by_runs: dict[tuple[str, ...], list[str]] = {}
        for label in runner.specs:
            runs = [run for test in current if test.tracker == label for run in test.next_runs()]
            labels_by_runs.setdefault(tuple(spec for spec, _ in runs), []).append(label)
        outcomes: dict[str, dict[str, tuple[bool, str]]] = {}
        for sequences, labels in labels_by_runs.items():
            if sequences:
                outcomes |= _outcomes(runner, labels, sequences)
        current = [
            entry.extended_by(outcomes[entry.tracker]) if entry.next_runs() else entry
            for entry in current
        ]
    return current


def _outcomes(
    runner: _Runner, labels: Sequence[str], sequences: Sequence[str]
) -> dict[str, dict[str, tuple[bool, str]]]:
    """Return by tracker and sequence whether the run survived, and why it failed."""
    runs, specs = runner.run(labels, sequences)
    outcomes: dict[str, dict[str, tuple[bool, str]]] = {}
    columns = ["tracker", "sequence", "status", "failure", "first_loss", "frames"]
    for label, name, status, failure, loss, frames in runs[columns].itertuples(index=False):
        survived = status == "finished" and loss >= frames
        reason = "" if status == "finished" else str(failure)
        outcomes.setdefault(label, {})[specs[name]] = bool(survived), reason
    return outcomes
