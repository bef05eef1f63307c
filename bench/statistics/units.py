"""Statistical units: sequences, families or scenes, derived from the names of sequences."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.rules import MIN_UNITS

Unit = Literal["sequence", "family", "scene"]
"""Kind of a statistical unit. A family is the part of a sequence's name before the first `:`."""

_PLURALS = {"sequence": "sequences", "family": "families", "scene": "scenes"}


@dataclass(frozen=True)
class StatisticalUnits:
    """Grouping of sequences into units of intervals and decisions."""

    kind: Unit
    labels: list[str]  # name of each unit, ordered by first occurrence
    members: list[NDArray[np.intp]]  # indices of the sequences of each unit
    families: int  # number of families

    def __len__(self) -> int:
        """Return the number of units."""
        return len(self.labels)

    @property
    def plural(self) -> str:
        """Plural of the kind: `families`."""
        return _PLURALS[self.kind]

    @property
    def scope(self) -> str:
        """Population to which a decision applies: `for new scenes of these 2 families only`."""
        if self.kind != "scene":
            return f"for new {self.plural}"
        families = f"these {self.families} families" if self.families > 1 else "this family"
        return f"for new scenes of {families} only"

    @property
    def remedy(self) -> str:
        """Advice if there are too few families; empty for other units."""
        if self.kind != "family" or len(self) >= MIN_UNITS:
            return ""
        return "; use --unit scene for conclusions about new scenes of these families"

    def means(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return the mean over the sequences of every unit: (..., sequences) to (..., units)."""
        by_sequence = np.asarray(values, np.float64)
        columns = [by_sequence[..., member].mean(axis=-1) for member in self.members]
        return np.stack(columns, axis=-1) if columns else by_sequence[..., :0]


def units_of(sequences: Sequence[str], unit: str | None = None) -> StatisticalUnits:
    """Group sequences into units.

    Units are scenes if `unit` is "scene" or all sequences belong to one family, otherwise families.
    Families with one sequence each are called sequences. Variants of a scene form one unit.

    `sequences`: names; options follow the family as `:key=value`.

    >>> units_of(["box", "cup:scene=1", "cup:scene=2"]).labels
    ['box', 'cup']
    >>> units_of(["cup:scene=1:light=even", "cup:scene=1", "cup:scene=2"]).labels
    ['cup:scene=1', 'cup:scene=2']
    """
    families = [name.partition(":")[0] for name in sequences]
    n_families = len(set(families))
    kind: Unit
    if unit == "scene" or (n_families == 1 and len(sequences) > 1):
        kind, keys = "scene", [_scene(name) for name in sequences]
    else:
        kind, keys = "sequence" if n_families == len(sequences) else "family", families
    labels = list(dict.fromkeys(keys))
    array: NDArray[Any] = np.array(keys)
    return StatisticalUnits(
        kind, labels, [np.flatnonzero(array == label) for label in labels], n_families
    )


def _scene(name: str) -> str:
    """Return family and scene of a sequence; only the family for the default scene."""
    family, *options = name.split(":")
    scene = [option for option in options if option.startswith("scene=")]
    return ":".join([family, *scene])
