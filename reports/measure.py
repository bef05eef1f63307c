"""What a column of a table is: title, unit, which way is better."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

__all__ = ["Direction", "Measure"]

Direction: TypeAlias = Literal["higher", "lower"]


@dataclass(frozen=True)
class Measure:
    """A score as tables show it.

    Attributes
    ----------
    name : str
        Column of the runs' data frame.
    title : str
        Head of the table's column.
    unit : str
        Of what is shown; empty for pure numbers.
    direction : {'higher', 'lower'} or None
        Which value is better; None where neither is.
    decimals : int
        Digits shown after the point.
    scale : float
        Shown is the score times this (1000 shows seconds as milliseconds).
    out_of : str
        Column with the number that a count is out of; shown as `k of n` per sequence.
    """

    name: str
    title: str
    unit: str = ""
    direction: Direction | None = None
    decimals: int = 2
    scale: float = 1.0
    out_of: str = ""

    @property
    def head(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title
