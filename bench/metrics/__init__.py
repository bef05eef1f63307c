"""Scores of estimates; `presets` has one module for each metrics preset."""

from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from trackmark.bench.metrics.preset import Preset
from trackmark.datasets.spec_string import name_hint

__all__ = ["describe", "names"]

_FOLDER = Path(__file__).parent / "presets"


@cache
def names() -> list[str]:
    """Return the sorted names of the metrics presets, which are the names of their modules."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def preset(name: str) -> Preset:
    """Return the metrics preset with a name or alias; raise `ValueError` for an unknown one."""
    selected: Preset = _module(canonical_name(name)).PRESET
    return selected


def canonical_name(name: str) -> str:
    """Return the name of the preset with this name or alias; raise `ValueError` if unknown."""
    if not isinstance(name, str):
        raise TypeError(f"metrics is {name!r}. Expected: one name, for example 'otb'.")
    if name in names():
        return name
    aliases = _aliases()
    if name not in aliases:
        hint = name_hint(name, sorted([*names(), *aliases]))
        raise ValueError(f"Unknown metrics preset {name!r}.{hint}")
    return aliases[name]


def is_preset(name: str) -> bool:
    """Return whether a preset has this name or alias."""
    return name in names() or name in _aliases()


def describe(name: str) -> str:
    """Return the definition of a preset: one line, and one paragraph with the source."""
    return (_module(canonical_name(name)).__doc__ or "").strip()


def _aliases() -> dict[str, str]:
    return {alias: name for name in names() for alias in _module(name).PRESET.aliases}


@cache
def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.metrics.presets.{name.replace('-', '_')}")
