"""Tables, data and test cases of trackers' speeds."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import pandas as pd

from bench.comparing.speed_check import SpeedCheck
from reports.tables import MISSING, Cell, Table

_ORDER = ("slower", "inconclusive", "faster", "as fast")


def speed_table(checks: Mapping[str, SpeedCheck]) -> Table:
    """Return a table of all trackers, the slower ones first."""
    rows = [
        [Cell(check.state), Cell(label), *map(Cell, _figures(check))]
        for label, check in _in_order(checks)
    ]
    return Table(
        name="speeds",
        caption="CPU time of updates, now relative to before, with its 95 % interval.",
        heads=["", "tracker", "time", "95 %", "sessions"],
        n_labels=2,
        rows=rows,
        notes=[f"{label}: {check.reason}." for label, check in checks.items() if check.reason],
        data=pd.DataFrame(speed_data(checks)),
    )


def _figures(check: SpeedCheck) -> tuple[str, str, str]:
    pace = check.pace
    if pace is None:
        return MISSING, MISSING, MISSING
    return f"{pace.change:+.1%}", f"{pace.low:+.1%} to {pace.high:+.1%}", str(pace.sessions)


def speed_cases(checks: Mapping[str, SpeedCheck]) -> list[tuple[str, str, str]]:
    """Return tracker, state and words of each test case for JUnit's XML."""
    return [
        (label, check.state, check.reason or "time {} ({})".format(*_figures(check)))
        for label, check in _in_order(checks)
    ]


def speed_data(checks: Mapping[str, SpeedCheck]) -> list[dict[str, Any]]:
    """Return the entries of `--json`; changes are relative, 0.05 if it takes 5 % longer."""
    return [
        {"tracker": label, "state": check.state, "reason": check.reason}
        | ({} if check.pace is None else asdict(check.pace))
        for label, check in _in_order(checks)
    ]


def _in_order(checks: Mapping[str, SpeedCheck]) -> list[tuple[str, SpeedCheck]]:
    return sorted(checks.items(), key=lambda entry: _ORDER.index(entry[1].state))
