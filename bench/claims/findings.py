"""What was found of a claim under one reading, and what it was found from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import pandas as pd

from bench.claims.kinds import CheckTest
from bench.claims.ledger import Claim
from bench.statistics.verdicts import Verdict

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
        How the text was read, by column of readings; a column that is not there, or is empty
        where the headline's is not: the finding depends on none of its values.
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
    light: str = "both"
    scenes: str = "kept"
    group: str = ""
    post_hoc: bool = False


@dataclass(frozen=True)
class Evidence:
    """What a check is given.

    Attributes
    ----------
    claim : Claim
        The claim, with the settings of its test.
    scores : DataFrame
        As for `bench.claims.evaluation.judge`.
    tables : mapping of str to DataFrame
        What else was measured, by name.
    """

    claim: Claim
    scores: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]

    def setting(self, key: str) -> float:
        """A number among the settings of the claim's check."""
        return float(self._settings[key])  # type: ignore[arg-type]  # a list is refused by float

    def names(self, key: str) -> list[str]:
        """A list of names among the settings of the claim's check."""
        names = self._settings[key]
        return names if isinstance(names, list) else [str(names)]

    @property
    def _settings(self) -> Mapping[str, float | str | list[str]]:
        test = self.claim.test
        return test.settings if isinstance(test, CheckTest) else {}


Check = Callable[[Evidence], list[Finding]]
"""Finds what no generic test can; see `bench.claims.checks`."""
