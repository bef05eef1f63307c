"""What is known of a reproduction, and what a paper's own Python adds to it."""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bench.claims.conclusion import Conclusion
from bench.claims.kinds import Value
from bench.claims.ledger import Claim
from bench.claims.readings import Readings
from bench.claims.sides import Table as Lookup
from bench.evaluation.record import Run, Trace
from bench.experiments.contestant import contestant
from bench.experiments.experiment import ExperimentError
from bench.papers import Asked, Effort
from bench.papers.description import Description
from bench.papers.measures import Course, known_series
from bench.papers.runs import StoredRuns
from bench.papers.wording import Wording
from bench.store.truth import StoredTruth
from datasets.text_form import format_text, parse_text
from trackers import TrackerError

__all__ = ["Context", "hook", "own_module", "part_of"]


@dataclass(frozen=True)
class Context:
    """What is known of a reproduction, for tables, figures and a paper's own functions.

    Attributes
    ----------
    description : Description
        Of the paper.
    claims : mapping of str to Claim
        Its ledger.
    results, folder : Path
        Folder of all experiments, and that of the report.
    effort : Effort
        How much was asked for.
    asked : mapping of str to collection of Cell
        Runs that are meant, by experiment.
    scores : DataFrame
        See `bench.papers.runs.tidy_runs`; `experiments` (names between commas), `copied`.
    tables : dict of str to DataFrame
        What was measured beside the runs, by name.
    conclusions : list of Conclusion
        Of all claims, once they are judged.
    """

    description: Description
    claims: Mapping[str, Claim]
    results: Path
    folder: Path
    effort: Effort
    asked: Asked
    scores: pd.DataFrame
    tables: dict[str, pd.DataFrame] = field(default_factory=dict)
    conclusions: list[Conclusion] = field(default_factory=list)

    @property
    def readings(self) -> Readings:
        """The readings under which the ledger's claims are judged."""
        return next(iter(self.claims.values())).readings

    @cached_property
    def stored(self) -> StoredRuns:
        """Runs themselves."""
        return StoredRuns(self.results, self.asked)

    @cached_property
    def lookup(self) -> Lookup:
        """The scores, to look trackers up in."""
        return Lookup(self.scores, self.readings)

    @property
    def wording(self) -> Wording:
        """Words of trackers and settings."""
        return Wording(self.description)

    def text_of(
        self, tracker: str, sequence: str, further: Mapping[str, Value] | None = None
    ) -> str | None:
        """A tracker's text form with what is usual on a sequence; None for what there is not."""
        name, own = parse_text(tracker)
        usual = self.readings.usual.get(sequence, {}).get(name, {})
        text = format_text(name, {**usual, **(further or {}), **own})
        try:
            return contestant(text).label
        except TrackerError:
            return None

    def series(
        self, name: str, run: Run, truth: StoredTruth, sequence: str, trace: Trace = "online"
    ) -> NDArray[np.float64]:
        """A series of a run by frame."""
        course = Course(run, truth, sequence, self.description.tolerance, trace)
        return known_series(name, part_of(self.description.name, "SERIES"))(course)

    def across(
        self, tracker: str, sequence: str, further: Mapping[str, Value], parameter: str
    ) -> pd.DataFrame:
        """Runs of a tracker with any value of a parameter, where there are several."""
        name, own = parse_text(tracker)
        numbers = self.scores.loc[self.scores["tracker"] == name, parameter].dropna().unique()
        pieces = [
            self.lookup.runs(name, {**further, **own, parameter: _short(number)}, [sequence])
            for number in sorted(numbers)
        ]
        found = pd.concat(pieces) if pieces else self.scores.iloc[:0]
        return found if len(found[parameter].unique()) > 1 else found.iloc[:0]


def _short(number: Any) -> Any:
    return int(number) if float(number).is_integer() else float(number)


def own_module(paper: str, name: str) -> ModuleType | None:
    """A module of a paper's own; None where it has none."""
    if not (Path(__file__).parent / paper / f"{name}.py").is_file():
        return None
    return importlib.import_module(f"bench.papers.{paper}.{name}")


def part_of(paper: str, name: str, module: str = "measures") -> Any:
    """Something of a paper's own module; empty where it has none."""
    return getattr(own_module(paper, module), name, {})


def hook(paper: str, name: str) -> Callable[[Context], Any]:
    """A paper's own function, by `module.function`.

    Raises
    ------
    ExperimentError
        Where there is none.
    """
    module, _, function = name.rpartition(".")
    found = getattr(own_module(paper, module), function, None)
    if found is None:
        raise ExperimentError(f"bench/papers/{paper}/paper.toml: there is no function {name!r}.")
    return found  # type: ignore[no-any-return]  # a module's
