"""Store scores of trackers as a baseline for `trackmark check`."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._baseline_runs import BaselineRunner, check_entries
from trackmark.bench.commands._options import (
    Command,
    EngineOptions,
    FiniteRange,
    argument,
    matching_sequences,
    option,
    output_option,
    split_list,
    with_options,
)
from trackmark.bench.experiments.experiment import Experiment
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from trackmark.bench.comparing.baseline import Baseline


@dataclass(frozen=True, kw_only=True)
class BaselineOptions(EngineOptions):
    """Options of the command."""

    name: str = argument()
    trackers: str = option("Comma-separated trackers, as for `run`.", metavar="TRACKERS")
    sequences: str = option(
        "Comma-separated names, paths or patterns, as for `run`.", metavar="SEQUENCES"
    )
    seeds: int = option(
        "Number of repetitions of stochastic trackers.",
        metavar="INTEGER",
        default=20,
        type=click.IntRange(6, 10_000),
    )
    detect: float = option(
        "Drop of the mean overlap on one sequence that a check must detect.",
        metavar="FLOAT",
        default=0.05,
        type=FiniteRange(0, 1, min_open=True),
    )
    force: bool = output_option("Replace an existing baseline.")


@click.command("baseline", cls=Command)
@with_options(BaselineOptions)
def command(options: BaselineOptions) -> int:
    """Store scores of trackers as a baseline for `trackmark check`.

    The command writes baselines/NAME.toml, or NAME itself if it ends in .toml. Commit this small
    text file: it has one line per tracker and sequence, with the score and a digest of the boxes of
    each run. Missing runs are executed.

    For example:
      trackmark baseline mine --trackers camshift,matcher.py --sequences 'samples/*'
      trackmark baseline mine --trackers camshift --sequences plain/target --seeds 40 --force

    Exit codes: 0 success; 1 a run failed and nothing is written; 2 invalid usage or input, or a
    tracker uses random numbers without declaring them; 130 interrupted.
    """
    from trackmark.bench.comparing.baseline import (
        Baseline,
        baseline_path,
        surroundings,
        write_baseline,
    )
    from trackmark.bench.execution.plan import make_plan
    from trackmark.bench.store.results import Results

    name, path = options.name, baseline_path(options.name)
    if path.exists() and not options.force:
        raise click.UsageError(
            f"{path} exists. `trackmark check {name} --accept TRACKER` replaces the scores of one "
            "tracker; --force replaces the file with its list of accepted changes."
        )
    experiment = f"baseline-{path.stem}"
    trackers, sequences = split_list(options.trackers), matching_sequences(options.sequences)
    requested = Experiment(experiment, tuple(trackers), sequences)
    plan = make_plan(requested, Results(options.output / experiment), {})
    texts = {spec.label: text for text, spec in plan.trackers.items()}
    sources = {sequence.name: sequence.source for sequence in plan.sequences}
    runner = BaselineRunner(experiment, texts, sources, options)
    names = {label: list(sources) for label in texts}
    entries = runner.run(names, options.seeds)
    repeated = runner.repeat({label: list(sources)[:1] for label in texts})
    if not check_entries(entries, repeated, f"{path} is not written: runs failed."):
        return EXIT_NEGATIVE
    baseline = Baseline(entries, texts, options.seeds, options.detect, surroundings())
    write_baseline(baseline, path)
    runs = sum(len(entry.overlap) for row in entries.values() for entry in row.values())
    click.echo(
        f"{path}: {len(texts)} tracker{'s' * (len(texts) != 1)}, {len(sources)} "
        f"sequence{'s' * (len(sources) != 1)}, {runs} run{'s' * (runs != 1)}.\n"
        f"Commit it; `trackmark check {name}` compares with it."
    )
    for line in _sensitivity(baseline):
        click.echo(wrap(line))
    return 0


def _sensitivity(baseline: "Baseline") -> list[str]:
    """Return a line for each tracker with random scores: the drops that its seeds detect."""
    from trackmark.bench.statistics.accuracy_drop import (
        advised_seeds,
        detectable_drops,
        pooled_spread,
    )

    lines = {}
    for tracker, row in baseline.entries.items():
        scores = [entry.overlap for entry in row.values()]
        spread = pooled_spread(scores) if len(scores[0]) > 1 else 0.0
        if spread == 0.0:
            continue
        on_sequence, in_mean = detectable_drops(spread, len(scores), baseline.seeds)
        line = (
            f"{baseline.seeds} seeds detect a drop of {on_sequence:.2g} on one sequence, "
            f"or of {in_mean:.2g} in the mean, in 80 % of cases"
        )
        advised = advised_seeds(spread, len(scores), baseline.detect)
        if advised > baseline.seeds:
            line += f"; for {baseline.detect:g} on one sequence use --seeds {advised}"
        lines[tracker] = line
    if len(lines) == 1:
        return list(lines.values())
    return [f"{tracker}: {line}" for tracker, line in lines.items()]
