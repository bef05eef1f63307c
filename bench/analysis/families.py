"""Families that a user declares: sequences that belong together, such as clips of one video."""

import csv
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from trackmark.bench.analysis.run_checks import ComparisonError
from trackmark.datasets.decoding import quote
from trackmark.datasets.spec_string import name_hint

COLUMNS = ["sequence", "family"]


@dataclass(frozen=True)
class Families:
    """Declared family of sequences; `source` names the declaration in messages."""

    by_sequence: Mapping[str, str]
    source: str

    def by_name(self, sequences: Collection[str]) -> dict[str, str]:
        """Return the families of these sequences; raise `ComparisonError` if one has none.

        An empty name, None and NaN are no family.
        """
        families = {name: _name_of(self.by_sequence.get(name)) for name in sequences}
        if missing := [name for name, family in families.items() if not family]:
            raise ComparisonError(
                f"{self.source}: the sequence {missing[0]!r} has no family ({len(missing)} of "
                f"{len(sequences)} sequences have none).{name_hint(missing[0], self.by_sequence)} "
                "Give the family of every sequence; a sequence without relatives is a family of "
                "its own."
            )
        return families


def _name_of(family: object) -> str:
    """Return the name of a family; empty for None and NaN, which data frames have in empty cells.

    >>> _name_of(" street "), _name_of(3), _name_of(float("nan"))
    ('street', '3', '')
    """
    return "" if family is None or family != family else str(family).strip()


def read_families(file: str | Path) -> Families:
    """Return the families of a CSV file with the columns `sequence` and `family`.

    Other columns are ignored. Raises `ComparisonError` if the file is not readable, a column or a
    value is missing, or a sequence occurs twice.
    """
    try:
        with Path(file).expanduser().open(encoding="utf-8-sig", newline="") as lines:
            reader = csv.DictReader(lines, skipinitialspace=True)
            rows = [(reader.line_num, row) for row in reader]
            names = reader.fieldnames or []
    except OSError as error:
        raise ComparisonError(f"{file}: {error.strerror}.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ComparisonError(f"{file}: not a CSV file ({error}).") from None
    if missing := [name for name in COLUMNS if name not in names]:
        raise ComparisonError(
            f"{file}: missing columns {', '.join(missing)} (the first line is "
            f"{quote(','.join(names))}). Expected: columns {', '.join(COLUMNS)}, with a comma "
            "between them."
        )
    families: dict[str, str] = {}
    for line, row in rows:
        sequence, family = ((row[name] or "").strip() for name in COLUMNS)
        where = f"{file}, line {line}"
        if not (sequence and family):
            raise ComparisonError(f"{where}: {sequence!r}, {family!r}. Give sequence and family.")
        if sequence in families:
            raise ComparisonError(f"{where}: {sequence!r} is on an earlier line. Delete one.")
        families[sequence] = family
    return Families(families, str(file))
