"""Scores of boxes against truth: arrays in, numbers out. Truth is always the first argument."""

from difflib import get_close_matches
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

from trackmark.bench.metrics.preset import Preset

__all__ = ["canonical", "definition", "knows", "names", "preset"]

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
    found: Preset = _module(canonical(name)).PRESET
    return found


def canonical(name: str) -> str:
    """A preset's own name, from it or one of its further names; raises as `preset`."""
    known = names()
    if name in known:
        return name
    further = {also: of for of in known for also in preset(of).also}
    if name not in further:
        near = get_close_matches(name, [*known, *further], n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        all_names = ", ".join(sorted([*known, *further]))
        raise ValueError(f"unknown metrics preset {name!r}.{hint} Known: {all_names}.")
    return further[name]


def knows(name: str) -> bool:
    """Whether a name is a preset's, or one of its further names."""
    return name in names() or any(name in preset(of).also for of in names())


def definition(name: str) -> str:
    """What a preset's scores mean, and where that is from: a line, and a paragraph."""
    return (_module(canonical(name)).__doc__ or "").strip()


@cache
def _module(name: str) -> ModuleType:
    return import_module(f"trackmark.bench.metrics.presets.{name.replace('-', '_')}")
