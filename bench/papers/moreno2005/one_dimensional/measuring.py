"""All that is measured of the one-dimensional example; kept until its source changes."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import trackers
from bench.papers.examination import kept_tables
from bench.papers.moreno2005.one_dimensional.associating import association_rows
from bench.papers.moreno2005.one_dimensional.cues import FILTERS
from bench.papers.moreno2005.one_dimensional.factorising import factorisation
from bench.papers.moreno2005.one_dimensional.settings import (
    FRAMES,
    NUMBERS,
    SETTINGS,
    Course,
    course,
)
from bench.papers.moreno2005.one_dimensional.simulation import simulated
from bench.statistics.intervals import mean_interval
from datasets.source_digest import source_digest

__all__ = ["QUANTITIES", "differences", "measure", "trends"]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Section 3, one dimension"

REPETITIONS, ASSOCIATIONS = 200, 20
QUICK_REPETITIONS, QUICK_ASSOCIATIONS, QUICK_NUMBERS = 20, 4, (10, 50, 200, 500)

QUANTITIES = ("error", "position_error", "colour_error", "own_error", "own_colour_error")
PAIRS = (
    ("independent", "dependent"),
    ("observation", "independent"),
    ("observation", "dependent"),
    ("unweighted", "dependent"),
)
"""Filters whose errors are compared: first less second."""

FEW, MANY = 10, 500

_KEYS = ["set", "scale", "samples"]


class _Part(NamedTuple):
    """What one process measures at a time; -1 stands for the association."""

    setting: str
    samples: int


def measure(folder: Path, jobs: int, quick: bool = False) -> dict[str, pd.DataFrame]:
    """Simulate, or look up what was simulated before.

    Parameters
    ----------
    folder : Path
        Keeps what was measured, in `one-dimensional/`.
    jobs : int
        Worker processes.
    quick : bool
        Fewer numbers and repetitions: a look at whether it works.
    """
    digest = source_digest(Path(__file__), PACKAGE)
    repetitions, associations, numbers = (
        (QUICK_REPETITIONS, QUICK_ASSOCIATIONS, QUICK_NUMBERS)
        if quick
        else (REPETITIONS, ASSOCIATIONS, NUMBERS)
    )
    # The longest come first, so that no process is left alone with one in the end.
    parts = [_Part(name, number) for number in sorted(numbers)[::-1] for name in SETTINGS]
    parts += [_Part(name, -1) for name in SETTINGS]
    identities = {part: [*part, repetitions, associations, digest] for part in parts}
    measured = partial(_measured, repetitions=repetitions, associations=associations)
    kept = folder / "one-dimensional"
    tables = kept_tables(measured, identities, kept, jobs, TITLE)
    errors = tables["errors"].sort_values(_KEYS, kind="stable", ignore_index=True)
    return {
        "errors": errors,
        "differences": differences(errors),
        "trends": trends(errors),
        "association": tables["association"],
        "factorisation": factorisation(),
    }


def differences(errors: pd.DataFrame) -> pd.DataFrame:
    """Paired differences of errors; see the package."""
    return pd.DataFrame(
        {
            **dict(zip(_KEYS, keys, strict=True)),
            "pair": f"{first} less {second}",
            "quantity": quantity,
            **_limits(by_filter[first] - by_filter[second]),
        }
        for keys, rows in errors.groupby(_KEYS, sort=False)
        for quantity in QUANTITIES
        for by_filter in [rows.pivot_table(quantity, "repetition", "filter", dropna=False)]
        for first, second in PAIRS
        if {first, second} <= set(by_filter)
    )


def trends(errors: pd.DataFrame) -> pd.DataFrame:
    """How errors go on with the number of samples; see the package."""
    filters = errors[errors["filter"] != "observation"]
    rows = []
    for (name, scale, kind), part in filters.groupby(["set", "scale", "filter"], sort=False):
        means = part.groupby("samples")["error"].mean()
        by_number = part.pivot_table("error", "repetition", "samples")
        numbers = means.index.to_series()
        rows.append(
            {"set": name, "scale": scale, "filter": kind}
            | {"rank_correlation": means.corr(numbers, method="spearman")}
            | _limits(by_number[FEW] - by_number[MANY])
        )
    return pd.DataFrame(rows)


def _limits(values: "pd.Series[float]") -> dict[str, float]:
    interval = mean_interval(values)
    return {
        "mean": float(values.mean()),
        "standard_error": float(values.std() / np.sqrt(len(values))),
        "lower_limit": interval.low,
        "upper": interval.high,
    }


def _measured(part: _Part, repetitions: int, associations: int) -> Mapping[str, pd.DataFrame]:
    setting = SETTINGS[part.setting]
    labels = {"set": part.setting, "scale": f"{setting.scale:g}"}
    if part.samples < 0:
        seen = [(number, _course_of(part.setting, number)) for number in range(associations)]
        return {"association": pd.DataFrame(association_rows(setting, seen)).assign(**labels)}
    rows = _error_rows(part, range(repetitions))
    return {"errors": pd.DataFrame(rows).assign(samples=part.samples, **labels)}


def _course_of(name: str, repetition: int) -> Course:
    """The same whatever follows it."""
    return course(SETTINGS[name], FRAMES, np.random.default_rng([repetition]))


def _error_rows(part: _Part, repetitions: Sequence[int]) -> Iterator[dict[str, object]]:
    for repetition in repetitions:
        seen = _course_of(part.setting, repetition)
        off = seen.observed - seen.truth
        both = np.column_stack([off, off[:, 1]])
        yield {"repetition": repetition, "filter": "observation", **_errors(both)}
        for position, kind in enumerate(FILTERS):
            generator = np.random.default_rng([repetition, part.samples, position])
            found = simulated(kind, SETTINGS[part.setting], part.samples, seen, generator)
            off = found[:, :3] - seen.truth[:, [0, 1, 1]]
            effective = float(found[:, 3].mean())
            yield {
                "repetition": repetition,
                "filter": kind,
                **_errors(off),
                "effective": effective,
            }


def _errors(off: NDArray[np.float64]) -> dict[str, float]:
    """Means over frames; `off` is position, colour, and colour by the filter's own estimate."""
    position, colour, own = np.abs(off).mean(axis=0).tolist()
    return {
        "error": float(np.hypot(off[:, 0], off[:, 1]).mean()),
        "position_error": position,
        "colour_error": colour,
        "own_error": float(np.hypot(off[:, 0], off[:, 2]).mean()),
        "own_colour_error": own,
    }
