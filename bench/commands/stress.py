"""Find breaking points: the level of a difficulty at which half of a tracker's runs survive."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import (
    chosen_sequences,
    engine_options,
    json_option,
    output_option,
    progress_bar,
    refresh_index,
    split_list,
    telling_of_replaced,
)
from trackmark.bench.experiments.experiment import Experiment, SequenceSource

if TYPE_CHECKING:
    import pandas as pd

    from trackmark.bench.comparing.stressing import Series
    from trackmark.bench.execution.plan import KnownSequences

REPETITIONS = 3
"""Of trackers that draw random numbers, on --recorded sequences."""


@click.command("stress")
@click.argument("trackers", nargs=-1, required=True)
@click.option(
    "--knob",
    "knobs",
    required=True,
    help="Comma-separated filters (noise, blur, gain, size, motion, step, occlusion, similarity, "
    "box_error) or knobs of the scenes; NAME=FROM..TO sets the range, from easy to hard.",
)
@click.option(
    "--sequences",
    default="plain/target",
    show_default=True,
    help="Comma-separated names (with * and ?) or paths; scenes vary unless one is named.",
)
@click.option(
    "--runs",
    type=click.IntRange(20),
    default=100,
    show_default=True,
    help="Most runs of a tracker under a knob; fewer where its point is known before.",
)
@click.option(
    "--against",
    default="camshift",
    show_default=True,
    help="The baseline that breaking points are set beside.",
)
@click.option("--recorded", help="Correlate breaking points with the overlap on these sequences.")
@click.option("--name", default="stress", show_default=True, help="Name of the results' folder.")
@click.option(
    "--folder", type=click.Path(path_type=Path), help="Write tables, curves and all runs here."
)
@output_option
@engine_options
@json_option
def command(
    trackers: tuple[str, ...],
    knobs: str,
    sequences: str,
    runs: int,
    against: str,
    recorded: str | None,
    name: str,
    folder: Path | None,
    output: Path,
    means: dict[str, Any],
    as_json: bool,
) -> int:
    """Turn one knob after another until TRACKERS lose the target.

    Runs are placed where the runs before leave most in doubt. What was run before is not run
    again. See docs/stress.md.
    """
    from trackmark.bench.comparing.breaking import Breaking, as_data, tables, write_curves
    from trackmark.bench.comparing.stressing import Course, Series, knob_of
    from trackmark.bench.experiments.tracker_files import settled
    from trackmark.reports.renderers import to_text
    from trackmark.reports.table_width import on_terminal
    from trackmark.reports.write import what_was_written, write_tables

    asked = split_list(knobs)
    if not asked:
        raise click.UsageError("--knob names none.")
    chosen = settled(text for given in (*trackers, against) for text in split_list(given))
    texts = {one.label: text for text, one in chosen.items()}
    course = Course([source.text for source in chosen_sequences(sequences, None)])
    turned = {knob_of(text, course.sequences): None for text in asked}
    if len({knob.name for knob in turned}) < len(turned):
        raise click.UsageError("--knob names one twice, with different ranges.")
    series = [Series(label, knob, course, runs) for knob in turned for label in texts]
    runner = _Runner(name, output, means)
    performed = _performed(runner, texts, series)
    scores = _scores(runner, texts, recorded) if recorded else {}
    found = Breaking(performed, chosen[against].label, scores)
    if as_json:
        click.echo(json.dumps(as_data(found), allow_nan=False))
    else:
        click.echo("\n".join(on_terminal(table, to_text) for table in tables(found)), nl=False)
    if folder is not None:
        paths = [*write_tables(folder, tables(found, whole=True)), *write_curves(found, folder)]
        click.echo("\n".join(what_was_written(paths)), err=True)
    return 0


class _Runner:
    """Runs trackers on sequences into one folder of results: what is not there yet."""

    def __init__(self, name: str, output: Path, means: Mapping[str, Any]) -> None:
        self._name, self._output, self._means = name, output, means
        self.known: KnownSequences = {}
        refresh_index(output / name)

    def run(
        self, trackers: Sequence[str], sequences: Sequence[SequenceSource], repetitions: int = 1
    ) -> "pd.DataFrame":
        """The runs of all trackers on all sequences, as `load_results` gives them."""
        from trackmark.bench.execution.executor import Execution
        from trackmark.bench.store.loading import load_results
        from trackmark.datasets import SequenceError

        experiment = Experiment(
            self._name, tuple(trackers), tuple(sequences), repetitions, title="Breaking points"
        )
        execution = Execution(experiment, self._output, known=self.known, **self._means)
        with telling_of_replaced(execution), progress_bar(execution.work, "frame") as progress:
            for _ in execution.rows(progress):
                pass
        if execution.errors:
            raise SequenceError("\n".join(execution.errors))
        return load_results(execution.folder, execution.plan.asked().cells)


def _performed(
    runner: _Runner, texts: Mapping[str, str], series: "Sequence[Series]"
) -> "list[Series]":
    """All series to their ends, a batch of each at a time.

    Trackers that want the same runs, as all do first, make them in lock step.
    """
    current = list(series)
    while any(one.wanted() for one in current):
        alike: dict[tuple[str, ...], list[str]] = {}
        for label in texts:
            wanted = [text for one in current if one.tracker == label for text, _ in one.wanted()]
            alike.setdefault(tuple(wanted), []).append(label)
        outcomes: dict[str, dict[str, tuple[bool, str]]] = {}
        for together, labels in alike.items():
            if together:
                outcomes |= _outcomes(runner, {label: texts[label] for label in labels}, together)
        current = [
            one.with_trials(outcomes[one.tracker]) if one.wanted() else one for one in current
        ]
        runs = sum(len(one.trials) for one in current)
        click.echo(f"{runs} runs; {sum(bool(one.wanted()) for one in current)} go on.", err=True)
    return current


def _outcomes(
    runner: _Runner, texts: Mapping[str, str], wanted: Sequence[str]
) -> dict[str, dict[str, tuple[bool, str]]]:
    """By tracker and sequence: whether the run survived, and why it failed."""
    sources = [SequenceSource(text) for text in wanted]
    runs = runner.run(list(texts.values()), sources)
    by_name = {runner.known[source].name: source.text for source in sources}
    found: dict[str, dict[str, tuple[bool, str]]] = {label: {} for label in texts}
    columns = ["tracker", "sequence", "status", "failure", "first_loss", "frames"]
    for label, name, status, failure, loss, frames in runs[columns].itertuples(index=False):
        survived = status == "finished" and loss >= frames
        found[label][by_name[name]] = bool(survived), "" if status == "finished" else str(failure)
    return found


def _scores(runner: _Runner, texts: Mapping[str, str], recorded: str) -> dict[str, list[float]]:
    """Return the mean overlap by tracker and recorded sequence; a failed run counts as 0."""
    runs = runner.run(list(texts.values()), chosen_sequences(recorded, None), REPETITIONS)
    runs["mean_overlap"] = runs["mean_overlap"].mask(runs["status"] == "failed", 0.0)
    cells = runs.groupby(["tracker", "sequence"], observed=True, sort=False)["mean_overlap"].mean()
    return {label: cells[label].tolist() for label in texts}
