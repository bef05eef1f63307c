"""What became of trackers' speeds: as a table, as data, in JUnit's XML."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import pandas as pd

from bench.comparing.clocking import Clocked
from reports.tables import MISSING, Cell, Table

__all__ = ["speeds_as_cases", "speeds_as_data", "speeds_table"]

_ORDER = ("slower", "cannot tell", "faster", "as fast")


def speeds_table(found: Mapping[str, Clocked]) -> Table:
    """All trackers, the slower ones first."""
    rows = [
        [Cell(entry.state), Cell(label), *map(Cell, _figures(entry))]
        for label, entry in _in_order(found)
    ]
    notes = [f"{label}: {entry.reason}." for label, entry in found.items() if entry.reason]
    return Table(
        name="speeds",
        caption="CPU time of updates, now relative to before, with its 95 % interval.",
        heads=["", "tracker", "time", "95 %", "sessions"],
        n_labels=2,
        rows=rows,
        notes=notes,
        data=pd.DataFrame(speeds_as_data(found)),
    )


def _figures(entry: Clocked) -> tuple[str, str, str]:
    pace = entry.pace
    if pace is None:
        return MISSING, MISSING, MISSING
    return f"{pace.change:+.1%}", f"{pace.low:+.1%} to {pace.high:+.1%}", str(pace.sessions)


def speeds_as_cases(found: Mapping[str, Clocked]) -> list[tuple[str, str, str]]:
    """For JUnit's XML: tracker, state and words."""
    return [
        (label, entry.state, entry.reason or f"time {_figures(entry)[0]} ({_figures(entry)[1]})")
        for label, entry in _in_order(found)
    ]


def speeds_as_data(found: Mapping[str, Clocked]) -> list[dict[str, Any]]:
    """For `--json`; changes are relative, 0.05 where it takes 5 % longer."""
    return [
        {"tracker": label, "state": entry.state, "reason": entry.reason}
        | ({} if entry.pace is None else asdict(entry.pace))
        for label, entry in _in_order(found)
    ]


def _in_order(found: Mapping[str, Clocked]) -> list[tuple[str, Clocked]]:
    return sorted(found.items(), key=lambda one: _ORDER.index(one[1].state))
