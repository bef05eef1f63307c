"""Registry of filters: their specification, and sequences with filters."""

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from trackmark.datasets.decoding import quote
from trackmark.datasets.filters import geometry, light, timing
from trackmark.datasets.interface import Sequence, SequenceError
from trackmark.datasets.source_digest import tree_digest
from trackmark.datasets.spec_string import format_text, name_hint

PREFIX = "filter."

DRAW = "draw"  # option with the seed of the random numbers for noise and directions; 0 by default


@dataclass(frozen=True)
class Filter:
    """Function of a filter, and the range of its values.

    Attributes
    ----------
    apply : callable
        Function of a sequence, a value and the value of `draw`; returns a sequence.
    unit : str
        Unit of the values.
    low, high : float
        Smallest and largest value.
    easy, hard : float
        Range in which `trackmark stress` searches the breaking point of a tracker.
    is_integer : bool
        Whether values are integers.
    logarithmic : bool
        Whether the values that `trackmark stress` tests have equal ratios, not equal differences.
    """

    apply: Callable[[Sequence, float, int], Sequence]
    unit: str
    low: float
    high: float
    easy: float
    hard: float
    is_integer: bool = False
    logarithmic: bool = False


# filters by name, in the order of their application; docs/stress.md explains their values
FILTERS: dict[str, Filter] = {
    "start": Filter(timing.start, "frames", 0, 1e6, 0, 1, is_integer=True),
    "step": Filter(timing.step, "frames", 1, 1000, 1, 20, is_integer=True, logarithmic=True),
    "size": Filter(geometry.size, "pixels", 1, 1000, 48, 4, logarithmic=True),
    "motion": Filter(geometry.motion, "target widths/frame", 0, 10, 0, 1.5),
    "occlusion": Filter(geometry.occlusion, "frames", 0, 1e6, 0, 60, is_integer=True),
    "similarity": Filter(geometry.similarity, "share", 0, 1, 0, 1),
    "gain": Filter(light.gain, "times the light", 0.001, 1000, 1, 0.02, logarithmic=True),
    "blur": Filter(light.blur, "pixels", 0, 200, 0, 40),
    "noise": Filter(light.noise, "grey levels", 0, 255, 0, 160),
    "box_error": Filter(geometry.box_error, "box sizes", 0, 2, 0, 1),
}

# Filters that preserve polygons and masks. With other filters, the ground truth is only boxes.
_SHAPE_PRESERVING = frozenset({"occlusion", "similarity", "gain", "blur", "noise", "box_error"})


def split_filters(spec: str) -> tuple[str, dict[str, float]]:
    """Split the specification of a sequence into the part without filters and the filters' values.

    Raises `SequenceError` for an unknown filter, a filter that is given twice, or a value that is
    out of range.
    """
    name_of_sequence, *options = spec.split(":")
    values: dict[str, float] = {}
    for option in options:
        key, _, value = option.partition("=")
        if key.startswith(PREFIX):
            name = key.removeprefix(PREFIX)
            if name in values:
                raise SequenceError(f"{quote(spec)}: {quote(key)} is given twice.")
            values[name] = _checked(spec, name, value)
    other_options = [option for option in options if not option.startswith(PREFIX)]
    return ":".join([name_of_sequence, *other_options]), values


def _checked(spec: str, name: str, option_value: str) -> float:
    """Return the value of a filter, checked against the filter's range."""
    if name != DRAW and name not in FILTERS:
        hint = name_hint(name, [*FILTERS, DRAW])
        raise SequenceError(f"{quote(spec)}: unknown filter {quote(name)}.{hint}")
    low, high, is_integer = 0.0, 2.0**32 - 1, True
    if name != DRAW:
        low, high, is_integer = FILTERS[name].low, FILTERS[name].high, FILTERS[name].is_integer
    try:
        value = float(option_value)
    except ValueError:
        value = math.nan
    if not low <= value <= high or (is_integer and not value.is_integer()):
        noun = "an integer" if is_integer else "a number"
        raise SequenceError(
            f"{quote(spec)}: {PREFIX}{name} is {quote(option_value)}. Expected: {noun} "
            f"from {low:g} to {high:g}."
        )
    return value


def with_filters(spec: str, values: Mapping[str, float]) -> str:
    """Return a sequence's name or path followed by filters, always in the same order."""
    ordered = [name for name in [*FILTERS, DRAW] if name in values]
    return format_text(spec, {f"{PREFIX}{name}": values[name] for name in ordered})


def filtered(sequence: Sequence, values: Mapping[str, float]) -> Sequence:
    """Apply filters to a sequence.

    `sequence` must have ground truth if a filter depends on the target's position. `values` are the
    values of the filters and of `draw`, by name; see `split_filters`.

    Raises `SequenceError` if the sequence is too short, or the images become too large.
    """
    result = sequence
    draw = int(values.get(DRAW, 0))
    for name, selected in FILTERS.items():
        if name in values:
            result = selected.apply(result, values[name], draw)
    name = with_filters(sequence.name, values)

    def fingerprint() -> str:
        identity = [sequence.fingerprint, dict(values), _source_digests()]
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:16]

    shapes = sequence.shapes if values.keys() <= _SHAPE_PRESERVING | {DRAW} else None
    return timing.with_changes(result, name=name, fingerprint=fingerprint, shapes=shapes)


@cache
def _source_digests() -> list[str]:
    """Return the digests of the filters' source, which are part of each fingerprint."""
    folder = Path(__file__).parent
    return [tree_digest(Path(str(module.__file__)), folder) for module in (timing, geometry, light)]
