"""Keep what trackers score now, for `trackmark check`."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from bench.commands._design import Bench, budget_option
from bench.commands._options import chosen_sequences, engine_options, output_option, split_list

__all__ = ["command"]


@click.command("baseline")
@click.argument("name")
@click.option("--trackers", required=True, help="Comma-separated, as for `run`.")
@click.option("--sequences", required=True, help="Comma-separated names or paths, as for `run`.")
@click.option(
    "--seeds",
    type=click.IntRange(2),
    default=5,
    show_default=True,
    help="Repetitions of trackers that draw, to begin with.",
)
@click.option(
    "--detect",
    type=click.FloatRange(0, 1, min_open=True),
    default=0.05,
    show_default=True,
    help="Drop of the mean overlap on one sequence that must be found.",
)
@click.option("--time", "timed", is_flag=True, help="Keep the trackers' speed, too.")
@click.option("--force", is_flag=True, help="Replace a baseline that is there.")
@budget_option
@output_option
@engine_options
def command(
    name: str,
    trackers: str,
    sequences: str,
    seeds: int,
    detect: float,
    timed: bool,
    force: bool,
    budget: float,
    output: Path,
    means: dict[str, Any],
) -> int:
    """Write the baseline NAME (baselines/NAME.toml, or a path that ends in .toml).

    It is a small text file to be committed: a line a tracker and sequence. Trackers that draw
    are repeated until a drop of --detect would be found in 80 % of cases, or the budget ends.
    """
    from bench.comparing.baseline import DECISIVE, baseline_path, lacking, write_baseline
    from bench.comparing.clocking import Clock
    from bench.execution.plan import make_plan
    from bench.experiments.experiment import Experiment
    from bench.store.results import Results

    path = baseline_path(name)
    if path.exists() and not force:
        raise click.UsageError(
            f"{path} is there already. `trackmark check {name} --accept TRACKER` moves it on; "
            "--force makes it anew, and its accepted changes are forgotten."
        )
    asked = Experiment(
        f"baseline-{path.stem}",
        tuple(split_list(trackers)),
        chosen_sequences(sequences, None),
        repetitions=seeds,
    )
    plan = make_plan(asked, Results(output / asked.name), {})
    sources = {planned.name: planned.source for planned in plan.sequences}
    texts = {chosen.label: text for text, chosen in plan.trackers.items()}
    design = {(label, sequence): seeds for label in texts for sequence in sources}

    bench = Bench(asked.name, texts, sources, output, means, budget, may_fail=False)
    now = bench.extend(design, lacking, bench.run(design, detect), detect)
    if timed:
        clock = Clock(now, list(now.cells), budget, partial(click.echo, err=True))
        now = replace(now, speeds=clock.speeds())
    write_baseline(now, path)
    runs = [cell.scores[DECISIVE].n for cells in now.cells.values() for cell in cells.values()]
    click.echo(
        f"{path}: {len(runs)} cells ({len(now.cells)} x {len(sources)}), {sum(runs)} runs.\n"
        f"Commit it; `trackmark check {name}` compares with it."
    )
    short = len(lacking(now))
    if short:
        click.echo(
            f"{short} of {len(runs)} cells have too few runs to show a drop of {detect:g}: give a "
            "larger --budget, or --detect.",
            err=True,
        )
    return 0
