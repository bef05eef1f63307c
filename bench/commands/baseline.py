"""Store scores of trackers as a baseline for `trackmark check`."""

from statistics import fmean
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._baseline_runs import BaselineRunner, check_scores
from trackmark.bench.commands._options import (
    SPECIFICATION,
    Command,
    ExecutionOptions,
    FiniteRange,
    IntegerRange,
    execution_options,
    input_option,
    matching_sequences,
    output_option,
    sequences_option,
    split_list,
)
from trackmark.bench.commands._output_files import check_outputs, input_files
from trackmark.bench.experiments.experiment import Experiment
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from trackmark.bench.regression.baseline import Baseline


DEFAULT_REPETITIONS = 20
"""Number of repetitions per sequence in a baseline."""

DEFAULT_DETECTABLE_DROP = 0.05
"""Drop of the mean overlap on one sequence that `check` must detect."""


@click.command("baseline", cls=Command)
@click.argument("name", type=SPECIFICATION)
@input_option(
    "--trackers",
    required=True,
    metavar="TRACKERS",
    type=SPECIFICATION,
    help="Comma-separated trackers, as for `run`.",
)
@sequences_option(
    required=True,
    help="Comma-separated names, paths or patterns, as for `run`.",
)
@input_option(
    "--repetitions",
    type=IntegerRange(6, 10_000),
    default=DEFAULT_REPETITIONS,
    help="Number of repetitions of stochastic trackers.",
)
@input_option(
    "--detectable-drop",
    type=FiniteRange(0, 1, min_open=True),
    default=DEFAULT_DETECTABLE_DROP,
    help="Drop of the mean overlap on one sequence that a check must detect.",
)
@output_option("--force", is_flag=True, help="Replace an existing baseline.")
@execution_options
def command(
    name: str,
    trackers: str,
    sequences: str,
    repetitions: int,
    detectable_drop: float,
    force: bool,
    options: ExecutionOptions,
) -> int:
    """Store scores of trackers as a baseline for `trackmark check`.

    The command writes baselines/NAME.toml, or NAME itself if it ends in .toml. Commit this small
    text file: it has one line per tracker and sequence, with the score and a digest of the boxes of
    each run. Missing runs are executed.

    For example:
      trackmark baseline mine --trackers camshift,matcher.py --sequences 'samples/*'
      trackmark baseline mine --trackers camshift --sequences plain/target --repetitions 40 --force

    Exit codes: 0 success; 1 a run failed and nothing is written; 2 invalid usage or input, or a
    tracker uses random numbers without declaring them; 130 interrupted.
    """
    from trackmark.bench.execution.plan import make_plan
    from trackmark.bench.regression.baseline import (
        Baseline,
        baseline_path,
        current_environment,
        write_baseline,
    )
    from trackmark.bench.store.run_store import RunStore

    path = baseline_path(name)
    if path.exists() and not force:
        raise click.UsageError(
            f"{path} exists. `trackmark check {name} --accept TRACKER` replaces the scores of one "
            "tracker; --force replaces the file with its list of accepted changes."
        )
    experiment = f"baseline-{path.stem}"
    listed = split_list(trackers)
    selected = matching_sequences(sequences, trackers=listed)
    check_outputs({"NAME": path}, input_files(listed, selected))
    requested = Experiment(experiment, tuple(listed), selected)
    environment = current_environment()  # before the runs: a library that is missing costs no runs
    plan = make_plan(requested, RunStore(options.results_root / experiment), {})
    specs = {tracker.label: spec for spec, tracker in plan.trackers.items()}
    sources = {sequence.name: sequence.source for sequence in plan.sequences}
    runner = BaselineRunner(experiment, specs, sources, options)
    names = {label: list(sources) for label in specs}
    scores = runner.run(names, repetitions)
    repeated = runner.repeat({label: list(sources)[:1] for label in specs})
    if not check_scores(scores, repeated, f"{path} is not written: runs failed."):
        return EXIT_NEGATIVE
    baseline = Baseline(scores, specs, repetitions, detectable_drop, environment)
    write_baseline(baseline, path)
    runs = sum(len(score.overlap) for row in scores.values() for score in row.values())
    click.echo(
        f"{path}: {len(specs)} tracker{'s' * (len(specs) != 1)}, {len(sources)} "
        f"sequence{'s' * (len(sources) != 1)}, {runs} run{'s' * (runs != 1)}.\n"
        f"Commit it; `trackmark check {name}` compares with it."
    )
    for line in _sensitivity(baseline):
        click.echo(wrap(line))
    return 0


def _sensitivity(baseline: "Baseline") -> list[str]:
    """Return a line for each tracker with random scores: the drops that its repetitions detect.

    The simulated checks are those after a change of all these trackers, with new random numbers on
    every sequence. A check of fewer changes has fewer comparisons and finds more.
    """
    from trackmark.bench.statistics.accuracy_drop import found_drop, missed_drops

    scores_of = {
        tracker: [score.overlap for score in row.values()]
        for tracker, row in baseline.scores.items()
    }
    scores_of = {
        tracker: scores
        for tracker, scores in scores_of.items()
        if any(len(set(values)) > 1 for values in scores)
    }
    comparisons = sum(map(len, scores_of.values()))
    lines = {}
    for tracker, scores in scores_of.items():
        missed = missed_drops(scores, baseline.n_repetitions, comparisons)
        missed_in_mean = missed_drops(scores, baseline.n_repetitions, len(scores_of), in_mean=True)
        largest = fmean(map(fmean, scores))  # a larger drop is not possible
        on_sequence, in_mean = (
            f"{drop:.2g}" if (drop := found_drop(drops)) <= largest else ""
            for drops in (missed, missed_in_mean)
        )
        lines[tracker] = (
            f"{baseline.n_repetitions} repetitions detect {_drops_text(on_sequence, in_mean)}"
            f"{_advice(scores, missed, comparisons, baseline)}"
        )
    if len(lines) == 1:
        return list(lines.values())
    return [f"{tracker}: {line}" for tracker, line in lines.items()]


def _drops_text(on_sequence: str, in_mean: str) -> str:
    """Return the drops that are detected in 80 % of cases; an empty text stands for none."""
    drops = f"a drop of {on_sequence} on one sequence, or of {in_mean} in the mean,"
    if not in_mean:
        drops = f"a drop of {on_sequence} on one sequence, but none in the mean,"
    if not on_sequence:
        drops = f"a drop of {in_mean} in the mean, but none on one sequence,"
    return f"{drops if on_sequence or in_mean else 'no drop'} in 80 % of cases"


def _advice(
    scores: "Sequence[Sequence[float]]",
    missed: "NDArray[np.float64]",
    comparisons: int,
    baseline: "Baseline",
) -> str:
    """Return how often --detectable-drop is found, and how many repetitions would find it."""
    from trackmark.bench.statistics.accuracy_drop import (
        MAX_REPETITIONS,
        advised_repetitions,
        share_found,
    )
    from trackmark.bench.statistics.rules import MARGIN, POWER

    detectable_drop, share = baseline.detectable_drop, share_found(missed, baseline.detectable_drop)
    if share >= POWER:
        return ""
    current = f"{baseline.n_repetitions} detect it in {100 * share:.0f} %"
    if detectable_drop < MARGIN:
        return (
            f"; {detectable_drop:g} on one sequence is inside ±{MARGIN:g} and counts as no change"
        )
    advised = advised_repetitions(scores, baseline.n_repetitions, comparisons, detectable_drop)
    if advised is None:
        return (
            f"; for {detectable_drop:g} on one sequence {MAX_REPETITIONS} repetitions are too few "
            f"({current})"
        )
    return f"; for {detectable_drop:g} on one sequence use --repetitions {advised} ({current})"
