"""What was found of a claim under one reading, and what it was found from."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import pandas as pd

from bench.claims.kinds import CheckTest, Side
from bench.claims.ledger import Claim
from bench.claims.sides import Compared, Table, rows_by_reading
from bench.statistics.verdict_rules import Verdict

__all__ = ["Check", "Evidence", "Finding"]


@dataclass(frozen=True)
class Finding:
    """A verdict, and under which reading, on which part of the scores, it was found.

    Attributes
    ----------
    claim : str
        Its id.
    verdict : Verdict
        What was found.
    metric : str
        Which reading of "tracked successfully"; empty where the claim needs none.
    reading : mapping of str to str
        How the text was read: option by axis on which it depends.
    same : frozenset of tuple of str
        All readings under which it is the same: `bench.claims.readings.Readings.places`.
    light : str
        `both` for all cells together, else the light that they have.
    scenes : str
        `kept`: those that passed the static gate; `drawn`: all.
    group : str
        Part of the cells that was judged beside the whole; empty for the whole.
    post_hoc : bool
        Whether the reading was chosen after seeing results.
    """

    claim: str
    verdict: Verdict
    metric: str = ""
    reading: Mapping[str, str] = field(default_factory=dict)
    same: frozenset[tuple[str, ...]] = frozenset()
    light: str = "both"
    scenes: str = "kept"
    group: str = ""
    post_hoc: bool = False

    @property
    def told(self) -> str:
        """The reading in words: its options, but those that are no words."""
        return ", ".join(name for name in self.reading.values() if name)


@dataclass(frozen=True)
class Evidence:
    """What a check is given.

    Attributes
    ----------
    claim : Claim
        The claim, with the settings of its test.
    scores : DataFrame
        As for `bench.claims.judging.judge`.
    tables : mapping of str to DataFrame
        What else was measured, by name.
    comparisons : int
        Number of claims that share the 5 % of false answers, in a summary of several.
    """

    claim: Claim
    scores: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    comparisons: int = 1

    def setting(self, key: str) -> float:
        """A number among the settings of the claim's check."""
        return float(self._settings[key])  # type: ignore[arg-type]  # a list is refused by float

    def names(self, key: str) -> list[str]:
        """A list of names among the settings of the claim's check."""
        names = self._settings[key]
        return [str(name) for name in names] if isinstance(names, list) else [str(names)]

    @property
    def _settings(self) -> Mapping[str, object]:
        test = self.claim.test
        return test.settings if isinstance(test, CheckTest) else {}

    def by_reading(
        self, table: pd.DataFrame, sides: Sequence[Side], sequences: Sequence[str] | None = None
    ) -> Iterator[tuple[Callable[..., Finding], list[pd.DataFrame]]]:
        """Rows of sides under every reading that tells them apart, and what makes findings of it.

        Each reading comes twice: with all scenes that were drawn, and with those kept.

        Parameters
        ----------
        table : DataFrame
            Scores, or columns like theirs.
        sides : sequence of Side
            See `bench.claims.kinds`; `{}` for all rows.
        sequences : sequence of str, optional
            Those that are looked at; all by default.
        """
        readings, lookup = self.claim.readings, Table(table, self.claim.readings)
        compared = [Compared(lookup, side, sequences) for side in sides]
        for reading, same, rows in rows_by_reading(compared, readings):
            made = partial(
                Finding,
                self.claim.id,
                reading=reading.names,
                same=same,
                post_hoc=reading.post_hoc,
            )
            yield partial(made, scenes="drawn"), rows
            yield partial(made, scenes="kept"), [one[one["kept_scene"]] for one in rows]


Check = Callable[[Evidence], list[Finding]]
"""Finds what no generic test can."""
