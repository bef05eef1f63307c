"""Scores of estimates; `sets` has one module for each named set of metrics."""

from functools import cache
from importlib import import_module
from types import ModuleType

from trackmark.bench.metrics.interface import Metrics
from trackmark.datasets.spec_string import name_hint

__all__ = ["describe", "names"]

# A module is imported when its metrics are used: most commands need `native` only.
_NAMES = (
    *("got10k", "lasot", "long-term", "native"),
    *("otb", "trackingnet", "vot-anchor", "vot-supervised"),
)


def names() -> list[str]:
    """Return the sorted names of all metrics."""
    return list(_NAMES)


def find_metrics(name: str) -> Metrics:
    """Return the metrics with a name or alias; raise `ValueError` for an unknown one."""
    metrics: Metrics = _module(canonical_name(name)).METRICS
    return metrics


def canonical_name(name: str) -> str:
    """Return the name of the metrics with this name or alias; raise `ValueError` if unknown."""
    if not isinstance(name, str):
        raise TypeError(f"metrics is {name!r}. Expected: one name, for example 'otb'.")
    if name in _NAMES:
        return name
    aliases = _aliases()
    if name not in aliases:
        hint = name_hint(name, sorted([*_NAMES, *aliases]))
        raise ValueError(f"Unknown metrics {name!r}.{hint}")
    return aliases[name]


def are_metrics(name: str) -> bool:
    """Return whether metrics have this name or alias."""
    return name in _NAMES or name in _aliases()


def describe(name: str) -> str:
    """Return the definition of metrics: one line, and one paragraph with the source."""
    return (_module(canonical_name(name)).__doc__ or "").strip()


def _aliases() -> dict[str, str]:
    return {alias: name for name in _NAMES for alias in find_metrics(name).aliases}


@cache
def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.metrics.sets.{name.replace('-', '_')}")
