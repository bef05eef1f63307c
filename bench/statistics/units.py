"""Statistical units: sequences, families or scenes, derived from the names of sequences."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trackmark.bench.statistics.rules import MIN_UNITS

Unit = Literal["sequence", "family", "scene"]
"""Kind of a statistical unit. A family is the part of a sequence's name before the first `:`, or
what the user declares, such as the video of several clips.
"""

_PLURALS = {"sequence": "sequences", "family": "families", "scene": "scenes"}


@dataclass(frozen=True)
class StatisticalUnits:
    """Grouping of sequences into units of intervals and decisions."""

    unit_kind: Unit
    labels: list[str]  # name of each unit, ordered by first occurrence
    members: list[NDArray[np.intp]]  # indices of the sequences of each unit
    n_families: int  # number of families
    declared: bool = False  # True: the user declared the families

    def __len__(self) -> int:
        """Return the number of units."""
        return len(self.labels)

    @property
    def plural(self) -> str:
        """Plural of the kind, such as `families`."""
        return _PLURALS[self.unit_kind]

    @property
    def scope(self) -> str:
        """Population to which a decision applies: `for new scenes of these sequences only`."""
        if self.unit_kind != "scene":
            return f"for new {self.plural} of the same kind as these"
        sequences = "these sequences" if self.n_families > 1 else "this sequence"
        return f"for new scenes of {sequences} only"

    @property
    def remedy(self) -> str:
        """Advice if there are too few families; empty for other units."""
        if self.unit_kind != "family" or self.declared or len(self) >= MIN_UNITS:
            return ""
        return "; use --unit scene for conclusions about new scenes of these sequences"

    def means(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return the mean over the sequences of every unit: (..., sequences) to (..., units)."""
        by_sequence = np.asarray(values, np.float64)
        columns = [by_sequence[..., member].mean(axis=-1) for member in self.members]
        return np.stack(columns, axis=-1) if columns else by_sequence[..., :0]


def units_of(
    sequences: Sequence[str], unit: str | None = None, families: Mapping[str, str] | None = None
) -> StatisticalUnits:
    """Group sequences into units.

    Units are scenes if `unit` is "scene" or all sequences belong to one family, otherwise families.
    Families with one sequence each are called sequences. Variants of a scene form one unit.

    `sequences`: names; options follow the family as `:key=value`. `families`: declared family of
    every sequence (`comparing.families`). The units are then these families, also if there is only
    one.

    >>> units_of(["box", "cup:scene=1", "cup:scene=2"]).labels
    ['box', 'cup']
    >>> units_of(["cup:scene=1:light=even", "cup:scene=1", "cup:scene=2"]).labels
    ['cup:scene=1', 'cup:scene=2']
    """
    if families is not None:
        return _declared_units(sequences, families)
    names = [name.partition(":")[0] for name in sequences]
    n_families = len(set(names))
    unit_kind: Unit
    if unit == "scene" or (n_families == 1 and len(sequences) > 1):
        unit_kind, keys = "scene", [_scene(name) for name in sequences]
    else:
        unit_kind, keys = "sequence" if n_families == len(sequences) else "family", names
    return StatisticalUnits(unit_kind, *_grouped(keys), n_families)


def _declared_units(sequences: Sequence[str], families: Mapping[str, str]) -> StatisticalUnits:
    """Return the declared families as units; families of one sequence each are sequences."""
    keys = [families[name] for name in sequences]
    n_families = len(set(keys))
    if n_families == len(sequences):
        return StatisticalUnits("sequence", *_grouped(sequences), n_families, declared=True)
    return StatisticalUnits("family", *_grouped(keys), n_families, declared=True)


def _grouped(keys: Sequence[str]) -> tuple[list[str], list[NDArray[np.intp]]]:
    """Return the distinct keys, ordered by first occurrence, and the indices of each."""
    labels, array = list(dict.fromkeys(keys)), np.array(keys, object)
    return labels, [np.flatnonzero(array == label) for label in labels]


def _scene(name: str) -> str:
    """Return family and scene of a sequence; only the family for the default scene."""
    family, *options = name.split(":")
    scene = [option for option in options if option.startswith("scene=")]
    return ":".join([family, *scene])
