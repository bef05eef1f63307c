"""Scores of boxes against truth: arrays in, numbers out. Truth is always the first argument."""

from difflib import get_close_matches
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from bench.metrics.preset import Preset

__all__ = ["definition", "names", "preset"]

_FOLDER = Path(__file__).parent / "presets"


@cache
def names() -> list[str]:
    """Names of the metrics presets, sorted: a file each, found by its name."""
    files = _FOLDER.glob("[a-z]*.py")
    return sorted(file.stem.replace("_", "-") for file in files)


def preset(name: str) -> Preset:
    """Metrics preset of a name, or of one of its further names.

    Raises `ValueError` for an unknown one, with those that are known.
    """
    found: Preset = _module(name).PRESET
    return found


def definition(name: str) -> str:
    """What a preset's scores mean, and where that is from: a line, and a paragraph."""
    return (_module(name).__doc__ or "").strip()


@cache
def _module(name: str) -> ModuleType:
    known = names()
    if name not in known:
        name = _further_names().get(name, name)
    if name not in known:
        near = get_close_matches(name, [*known, *_further_names()], n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        raise ValueError(f"unknown metrics preset {name!r}.{hint} Known: {', '.join(known)}.")
    return import_module(f"bench.metrics.presets.{name.replace('-', '_')}")


@cache
def _further_names() -> dict[str, str]:
    return {also: name for name in names() for also in _module(name).PRESET.also}
