"""Running a baseline's cells, and adding repetitions in stages within a budget of time."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from bench.commands._options import progress_bar, refresh_index
from bench.experiments.experiment import Experiment, SequenceSource

if TYPE_CHECKING:
    from bench.comparing.baseline import Baseline, Design
    from bench.execution.plan import KnownSequences

__all__ = ["Bench", "budget_option"]


def _seconds(text: str) -> float:
    match = re.fullmatch(r"(\d+(?:\.\d+)?) ?(s|min|h)", text.strip())
    if match is None:
        raise click.BadParameter(f"{text!r} is no time such as 90s, 10min or 2h.")
    return float(match[1]) * {"s": 1, "min": 60, "h": 3600}[match[2]]


budget_option = click.option(
    "--budget",
    type=_seconds,
    metavar="TIME",
    default="10min",
    show_default=True,
    help="Time after which no repetitions are added, as 90s, 10min or 2h.",
)


class Bench:
    """Runs designs into one folder of results, stage by stage.

    `texts`: of the trackers, by label. `sources`: where sequences are, by name. `means`: what
    performs the work, for `Execution`.
    `may_fail`: whether failed runs count as lost ones, or are errors.
    """

    def __init__(
        self,
        name: str,
        texts: Mapping[str, str],
        sources: Mapping[str, SequenceSource],
        output: Path,
        means: Mapping[str, Any],
        budget: float,
        *,
        may_fail: bool,
    ) -> None:
        self.folder = output / name
        self._name, self._output, self._means = name, output, means
        self._texts, self._sources, self._may_fail = texts, sources, may_fail
        self._known: KnownSequences = {}
        self._ends = monotonic() + budget
        self._pace = 0.0  # seconds a run, in the last stage

    def run(self, design: "Design", detect: float) -> "Baseline":
        """Run what is not there yet of a design, and measure it."""
        from bench.comparing.baseline import measured
        from bench.execution.run import Execution
        from datasets import SequenceError

        groups: dict[tuple[str, int], list[str]] = {}
        for (tracker, sequence), repetitions in design.items():
            groups.setdefault((tracker, repetitions), []).append(sequence)
        alike: dict[tuple[int, tuple[str, ...]], list[str]] = {}  # run in lock step
        for (tracker, repetitions), names in groups.items():
            alike.setdefault((repetitions, tuple(names)), []).append(tracker)
        refresh_index(self.folder)
        began, ran = monotonic(), 0
        for (repetitions, sequences), trackers in alike.items():
            experiment = Experiment(
                name=self._name,
                trackers=tuple(self._texts[tracker] for tracker in trackers),
                sequences=tuple(self._sources[sequence] for sequence in sequences),
                repetitions=repetitions,
            )
            execution = Execution(experiment, self._output, known=self._known, **self._means)
            with progress_bar(execution.work, "frame") as progress:
                ran += sum(1 for _ in execution.rows(progress))
            if execution.errors:
                raise SequenceError("\n".join(execution.errors))
        if ran:
            self._pace = (monotonic() - began) / ran
        return measured(
            self.folder, design, self._texts, self._sources, detect, may_fail=self._may_fail
        )

    def extend(
        self,
        design: "Design",
        lacking: Callable[["Baseline"], Mapping[tuple[str, str], float]],
        now: "Baseline",
        detect: float,
    ) -> "Baseline":
        """Add repetitions, at most doubling each time, until none lack or the budget ends.

        `lacking` gives the repetitions that cells need, infinite where no number helps.
        """
        wanted = dict(design)
        while True:
            more = {
                cell: min(int(min(needed, 1e6)), 2 * wanted[cell])
                for cell, needed in lacking(now).items()
                if needed > wanted[cell] and needed < float("inf")
            }
            runs = sum(number - wanted[cell] for cell, number in more.items())
            if not runs:
                return now
            if monotonic() + runs * self._pace > self._ends:
                click.echo(
                    f"The budget ends here: {runs} more runs would take about "
                    f"{runs * self._pace:.0f} s. --budget gives more.",
                    err=True,
                )
                return now
            click.echo(f"Adding {runs} runs, to find a drop of {detect:g}.", err=True)
            wanted |= more
            now = self.run(wanted, detect)
