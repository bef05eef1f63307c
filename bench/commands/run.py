"""Run trackers on sequences and keep the results."""

import hashlib
import json
import math
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands import EXIT_ANSWER_IS_NO, EXIT_INTERRUPTED, EXIT_WRONG_INPUT
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
    truth_option,
)
from trackmark.bench.commands._terminal import complain
from trackmark.bench.experiments.experiment import (
    Experiment,
    ExperimentError,
    experiment_names,
    read_experiment,
)

if TYPE_CHECKING:
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.execution.plan import KnownSequences, Plan
    from trackmark.bench.store.layout import Cell

_LONGEST = 24  # letters of a tracker's or a sequence's name in that of a folder


@click.command("run")
@click.argument("experiment", nargs=-1, metavar="[EXPERIMENT]")
@click.option(
    "--trackers",
    help="Comma-separated: NAME[:preset=PRESET][:PARAMETER=VALUE]…, or path/to/file.py[:CLASS].",
)
@click.option("--sequences", help="Comma-separated names or paths, with * and ?, or folders.")
@truth_option
@click.option("--seeds", type=click.IntRange(1), help="Repetitions of trackers that draw.")
@protocol_option
@click.option("--timing", is_flag=True, help="Time the trackers, one by one, instead.")
@click.option(
    "--arrays",
    is_flag=True,
    help="New runs keep masks, contours, particles and maps, which the report's player shows.",
)
@click.option("--name", help="Name of the results' folder.  [default: made from what is asked]")
@click.option(
    "--keep",
    is_flag=True,
    help="Replace no stored run of another version: put all into NAME-2, NAME-3, …",
)
@click.option("--retry-failed", is_flag=True, help="Also repeat runs that failed.")
@click.option("--dry-run", is_flag=True, help="Run nothing; print what would be run.")
@output_option
@metrics_option
@engine_options
@json_option
def command(
    experiment: tuple[str, ...],
    trackers: str | None,
    sequences: str | None,
    truth: Path | None,
    seeds: int | None,
    protocol: str | None,
    timing: bool,
    arrays: bool,
    name: str | None,
    keep: bool,
    retry_failed: bool,
    dry_run: bool,
    output: Path,
    metrics: list[str],
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Run EXPERIMENT (a name or a .toml file), or --trackers on --sequences.

    What is done already is not done again. With --json a line with its scores for every run
    asked for (by --metrics, too); else tables of them. Exit status 1 where runs failed. With
    --dry-run nothing is run: the plan is printed, and how long it will take.
    """
    if not experiment and not (trackers and sequences):
        raise click.UsageError("Give an experiment, or --trackers and --sequences.")
    base = _only(experiment, options=bool(trackers or sequences))
    if base is not None and truth is not None:
        raise ExperimentError("--truth goes with --sequences.")
    given: dict[str, Any] = {
        "name": name,
        "trackers": tuple(split_list(trackers or "")),
        "sequences": chosen_sequences(sequences, truth) if sequences else (),
        "repetitions": seeds,
        "protocol": protocol,
        "timing": timing,
        "arrays": arrays,
    }
    given = {key: value for key, value in given.items() if value}
    if seeds:
        given["repeated"] = {}  # also for trackers that have a number of their own
    if base is None:
        named = ad_hoc_name(given.get("trackers", ()), split_list(sequences or ""), truth)
        chosen = Experiment(**{"name": named} | given)
    else:
        chosen = replace(base, **given)
    if keep:
        chosen, means["known"] = _kept_apart(chosen, output)
    if dry_run:
        return _show_plan(chosen, output, retry_failed=retry_failed, as_json=as_json, **means)
    means["metrics"] = metrics
    return execute(chosen, output, retry_failed=retry_failed, as_json=as_json, **means)


def _only(experiments: Sequence[str], *, options: bool) -> Experiment | None:
    """The experiment that is named, if any is.

    Raises `ExperimentError` for several, as a shell makes of a pattern behind an option.
    """
    known = experiment_names()
    others = [name for name in experiments if name not in known and not name.endswith(".toml")]
    if options and others and Path(others[0]).exists():
        raise ExperimentError(
            f"{others[0]} is no experiment. Does it come of a pattern? Put that in quotes, for "
            "your shell not to write it out: --sequences 'folder/*'."
        )
    if len(experiments) > 1:
        raise ExperimentError(f"give one experiment, not {len(experiments)}.")
    return read_experiment(experiments[0]) if experiments else None


def ad_hoc_name(trackers: Sequence[str], sequences: Sequence[str], truth: Path | None) -> str:
    """A name of what was asked: equal for the same trackers, sequences and truth, as typed.

    Raises `ExperimentError` where there are none.
    """
    if not (trackers and sequences):
        raise ExperimentError("there must be a tracker and a sequence to run.")
    trackers, sequences = sorted(trackers), sorted(sequences)
    asked = json.dumps([trackers, sequences, str(truth or "")])
    digest = hashlib.sha256(asked.encode()).hexdigest()[:6]
    return f"{_in_short(trackers)}-on-{_in_short(sequences)}-{digest}"


def _in_short(texts: Sequence[str]) -> str:
    """The first text's last part that has letters, and how many there are besides: `static+2`."""
    parts = [re.sub(r"[^\w.=]+", "-", part).strip("-._") for part in texts[0].split("/")]
    name = next(filter(None, reversed(parts)), "any")[:_LONGEST]
    return f"{name}+{len(texts) - 1}" if len(texts) > 1 else name


def _kept_apart(experiment: Experiment, output: Path) -> tuple[Experiment, "KnownSequences"]:
    """The experiment by the first name under which it replaces no run, and what it opened."""
    from trackmark.bench.execution.plan import State, make_plan
    from trackmark.bench.store.results import Results

    known: KnownSequences = {}
    names = chain([experiment.name], (f"{experiment.name}-{number}" for number in count(2)))
    plans = (
        make_plan(replace(experiment, name=name), Results(output / name), known) for name in names
    )
    return next(plan.experiment for plan in plans if not plan.count(State.STALE)), known


def execute(
    experiment: Experiment,
    output: Path,
    jobs: int | None = None,
    *,
    retry_failed: bool = False,
    as_json: bool = False,
    metrics: Sequence[str] = ("native",),
    **means: Any,
) -> int:
    """Run an experiment, say what came of it by some presets' `metrics`, give the exit status."""
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.execution.plan import State
    from trackmark.bench.store.index import read_index
    from trackmark.bench.store.layout import cell_of
    from trackmark.bench.store.results import Results

    refresh_index(output / experiment.name)
    with patience("Opening sequences") as opened:
        execution = Execution(
            experiment, output, jobs, retry_failed=retry_failed, opened=opened, **means
        )
    plan = execution.plan
    _remark(plan)
    stopped = False
    printed: set[Cell] = set()
    with telling_of_replaced(execution, " (--keep: in a folder of their own)"):
        try:
            with progress_bar(execution.work, "frame") as progress:
                for row in execution.rows(progress):
                    if as_json:
                        _print_row(row, execution.folder, metrics)
                        printed.add(cell_of(row))
        except KeyboardInterrupt:
            stopped = True
    # Counted on disk: a worker may have finished a run that nobody heard of any more.
    rows = read_index(Results(execution.folder))
    now = plan.seen_in(rows)
    failed = now.count(State.FAILED)
    there = f"{now.count(State.DONE)} of {len(plan)} runs are in {execution.folder}"
    there += f", {failed} failed." if failed else "."
    if stopped:
        click.echo(f"Stopped: {there} The same command goes on from there.", err=True)
        return EXIT_INTERRUPTED
    for error in execution.errors:
        complain(error)
    if as_json:
        _print_others(now, rows, printed, execution.folder, metrics)
        click.echo(there, err=True)
    elif metrics or failed:
        _print_tables(execution, metrics or ("native",))
        click.echo(there)
        _print_remarks(execution, failed)
        _print_formats([source.text for source in experiment.sequences])
    if execution.errors:
        return EXIT_WRONG_INPUT
    return EXIT_ANSWER_IS_NO if failed else 0


def _remark(plan: "Plan") -> None:
    """Say what of the input is not read."""
    for sequence in plan.sequences:
        if sequence.images_beyond_truth:
            click.echo(
                f"{sequence.name}: {sequence.images_beyond_truth} images beyond the last truth "
                "row are not read.",
                err=True,
            )


def _print_formats(texts: Sequence[str]) -> None:
    """What paths among the sequences were taken for, a line a format."""
    from trackmark import datasets
    from trackmark.reports.printable import wrapped

    kinds = {text: datasets.taken_for(text) for text in texts}
    for kind in filter(None, dict.fromkeys(kinds.values())):
        first, *others = [text for text in texts if kinds[text] == kind]
        more = f" and {len(others)} more" if others else ""
        click.echo(wrapped(f"{first}{more}: taken for {kind}."))


def _print_row(row: Mapping[str, Any], folder: Path, metrics: Sequence[str]) -> None:
    """A line of JSON: with the scores by other presets where these are asked for."""
    from trackmark.bench.store.index import for_json

    told = for_json(row)
    if list(metrics) != ["native"] or row["protocol"] not in ("accuracy", "timing"):
        from trackmark.bench.reporting.by_preset import (  # brings what makes tables
            fitting,
            scores_by,
        )

        fit = fitting(metrics, row["protocol"])
        if others := [name for name in fit if name != "native"]:
            told["metrics"] = scores_by(folder, row, others)
    click.echo(json.dumps(told, allow_nan=False))


def _print_others(
    now: "Plan",
    rows: Sequence[Mapping[str, Any]],
    printed: "set[Cell]",
    folder: Path,
    metrics: Sequence[str],
) -> None:
    """Rows of what was done before, which is an answer too."""
    from trackmark.bench.execution.plan import State
    from trackmark.bench.store.layout import cell_of

    for row in rows:
        cell = cell_of(row)
        if cell in now.cells and cell not in printed and now.state(cell) >= State.FAILED:
            _print_row(row, folder, metrics)


def _print_tables(execution: "Execution", metrics: Sequence[str]) -> None:
    from trackmark.bench.reporting.by_preset import summary_text

    with patience("Scoring runs"):
        text = summary_text(execution.folder, execution.plan.asked().cells, metrics)
    click.echo(text)


def _print_remarks(execution: "Execution", failed: int) -> None:
    if failed:
        command = shlex.join(["trackmark", "results", "failures", str(execution.folder)])
        click.echo(f"`{command}` tells why runs failed.")
    if math.isfinite(execution.overhead):
        microseconds = execution.overhead * 1e6
        click.echo(f"The harness itself took {microseconds:.1f} µs a frame and tracker.")


def _show_plan(
    experiment: Experiment,
    output: Path,
    *,
    retry_failed: bool,
    as_json: bool,
    **means: Any,
) -> int:
    """Print which runs are there, which are left, and how long these will take."""
    from trackmark.bench.execution.estimate import estimate, measured_before, words
    from trackmark.bench.execution.executor import Execution
    from trackmark.bench.execution.plan import State

    refresh_index(output / experiment.name)
    with patience("Opening sequences") as opened:
        execution = Execution(experiment, output, retry_failed=retry_failed, opened=opened, **means)
    plan, units = execution.plan, execution.units
    found = estimate(units, measured_before(output), execution.limits)
    states = [state.name.lower() for state in (State.DONE, State.FAILED, State.STALE, State.LEFT)]
    by_tracker = {
        chosen.label: dict(zip(states, reversed(counts), strict=True))
        for chosen, counts in zip(plan.trackers.values(), plan.counts().tolist(), strict=True)
    }
    bases = {basis.name.lower(): count for basis, count in found.bases.items()}
    if as_json:
        told = {
            "experiment": experiment.name,
            "trackers": by_tracker,
            "sequences": len(plan.sequences),
            "runs": len(plan),
            "to_run": units.runs,
            "units": len(units),
            "workers": units.workers,
            "seconds": [found.low, found.high],
            "estimated_from": bases,
        }
        click.echo(json.dumps(told))
        return 0
    total = {state: sum(counts[state] for counts in by_tracker.values()) for state in states}
    width = max(len(label) for label in [*by_tracker, "in all"])
    click.echo(f"{'tracker':{width}}" + "".join(f"{state:>9}" for state in states))
    for label, counts in [*by_tracker.items(), ("in all", total)]:
        click.echo(f"{label:{width}}" + "".join(f"{counts[state]:9}" for state in states))
    click.echo(
        f"\n{units.runs} of {len(plan)} runs on {len(plan.sequences)} sequences are to be run, in "
        f"{len(units)} units of work on {units.workers} workers.\nRuns go to {execution.folder}."
    )
    if units.runs:
        click.echo(f"This will take {words(found)}, estimated from:")
        for basis, count in bases.items():
            click.echo(f"  {_BASES[basis]}: {count} runs")
    return 0


_BASES = {
    "sequence": "runs of the same tracker on the same sequence",
    "tracker": "runs of the same tracker on other sequences",
    "name": "runs of the same tracker with other parameters",
    "probe": "a tracker's first frames on the shortest sequence, just now",
    "nothing": "nothing (the tracker failed on these frames; not counted)",
}
