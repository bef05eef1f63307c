"""Scores of boxes by the ground truth, which is always the first argument; a preset is a file."""

from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from trackmark.bench.metrics.preset import Preset
from trackmark.datasets.spec_string import close_match

_FOLDER = Path(__file__).parent / "presets"


@cache
def names() -> list[str]:
    """Return the sorted names of the metrics presets, which are those of their files."""
    return sorted(file.stem.replace("_", "-") for file in _FOLDER.glob("[a-z]*.py"))


def preset(name: str) -> Preset:
    """Return the metrics preset of a name or alias; raise `ValueError` if there is none."""
    selected: Preset = _module(canonical(name)).PRESET
    return selected


def canonical(name: str) -> str:
    """Return a preset's own name, given that name or an alias; raise as `preset`."""
    if name in names():
        return name
    aliases = _aliases()
    if name not in aliases:
        valid_names = sorted([*names(), *aliases])
        hint = close_match(name, valid_names)
        raise ValueError(f"unknown metrics preset {name!r}.{hint} Known: {', '.join(valid_names)}.")
    return aliases[name]


def knows(name: str) -> bool:
    """Return whether a preset has this name or alias."""
    return name in names() or name in _aliases()


def definition(name: str) -> str:
    """Return the meaning and source of a preset's scores: a line and a paragraph."""
    return (_module(canonical(name)).__doc__ or "").strip()


def _aliases() -> dict[str, str]:
    return {alias: name for name in names() for alias in _module(name).PRESET.also}


@cache
def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.metrics.presets.{name.replace('-', '_')}")
