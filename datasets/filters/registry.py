"""Which filters there are, how they are written, and a sequence under some of them."""

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
from trackmark.datasets.spec_string import close_match, format_text

PREFIX = "filter."

# Which of many equal draws a filter takes (its noise, its direction): a whole number, else 0.
DRAW = "draw"


@dataclass(frozen=True)
class Filter:
    """A filter: what it does, and the values that it takes.

    `low, high`: Least and greatest value. `easy, hard`: Values between which `trackmark stress`
    looks for a tracker's breaking point.
    """

    # gives the sequence with the difficulty of a value; the draw is a number of its own
    apply: Callable[[Sequence, float, int], Sequence]
    unit: str  # of its values
    low: float
    high: float
    easy: float
    hard: float
    whole: bool = False  # whether values are whole numbers
    # whether equal ratios of values, not differences, are equally far apart
    logarithmic: bool = False


FILTERS: dict[str, Filter] = {
    "start": Filter(timing.start, "frames", 0, 1e6, 0, 1, whole=True),
    "step": Filter(timing.step, "frames", 1, 1000, 1, 20, whole=True, logarithmic=True),
    "size": Filter(geometry.size, "pixels", 1, 1000, 48, 4, logarithmic=True),
    "motion": Filter(geometry.motion, "target widths/frame", 0, 10, 0, 1.5),
    "occlusion": Filter(geometry.occlusion, "frames", 0, 1e6, 0, 60, whole=True),
    "similarity": Filter(geometry.similarity, "share", 0, 1, 0, 1),
    "gain": Filter(light.gain, "times the light", 0.001, 1000, 1, 0.02, logarithmic=True),
    "blur": Filter(light.blur, "pixels", 0, 200, 0, 40),
    "noise": Filter(light.noise, "grey levels", 0, 255, 0, 160),
    "box_error": Filter(geometry.box_error, "box sizes", 0, 2, 0, 1),
}
"""In the order in which they are laid over: time, place, light, sensor, what is told of it all.
docs/stress.md says what their values mean.
"""


# Filters under which polygons and masks of a truth stay true; under others its boxes count.
IN_PLACE = frozenset({"occlusion", "similarity", "gain", "blur", "noise", "box_error"})


def split_filters(text: str) -> tuple[str, dict[str, float]]:
    """A sequence's text without filters, and the values of its filters, checked.

    Raises `SequenceError` for an unknown filter, one that is given twice, or a value that it does
    not take.
    """
    parts = text.split(":")
    values: dict[str, float] = {}
    for part in parts[1:]:
        key, _, value = part.partition("=")
        if key.startswith(PREFIX):
            name = key.removeprefix(PREFIX)
            if name in values:
                raise SequenceError(f"{quote(text)}: {quote(key)} is given twice.")
            values[name] = _checked(text, name, value)
    others = [part for part in parts[1:] if not part.startswith(PREFIX)]
    return ":".join([parts[0], *others]), values


def _checked(text: str, name: str, value: str) -> float:
    if name != DRAW and name not in FILTERS:
        known = ", ".join(f"{PREFIX}{one}" for one in [*FILTERS, DRAW])
        hint = close_match(name, FILTERS)
        raise SequenceError(f"{quote(text)}: unknown filter {quote(name)}.{hint} Known: {known}.")
    low, high, whole = 0.0, 2.0**32 - 1, True
    if name != DRAW:
        low, high, whole = FILTERS[name].low, FILTERS[name].high, FILTERS[name].whole
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not low <= number <= high or (whole and not number.is_integer()):
        kind = "a whole number" if whole else "a number"
        raise SequenceError(
            f"{quote(text)}: {PREFIX}{name} is {quote(value)}; give {kind} from {low:g} to "
            f"{high:g}."
        )
    return number


def with_filters(text: str, values: Mapping[str, float]) -> str:
    """A sequence's name or path with filters behind it, always in the same order."""
    ordered = [name for name in [*FILTERS, DRAW] if name in values]
    return format_text(text, {f"{PREFIX}{name}": values[name] for name in ordered})


def filtered(sequence: Sequence, values: Mapping[str, float]) -> Sequence:
    """A sequence under filters.

    `sequence`: With truth where a filter needs to know where the target is. `values`: By name; with
    `draw` among them, see `split_filters`. Raises `SequenceError` for a value that this sequence
    can't take: it is too short, or too large then.
    """
    made = sequence
    draw = int(values.get(DRAW, 0))
    for name, one in FILTERS.items():
        if name in values:
            made = one.apply(made, values[name], draw)
    name = with_filters(sequence.name, values)

    def fingerprint() -> str:
        identity = [sequence.fingerprint, dict(values), _code()]
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:16]

    shapes = sequence.shapes if values.keys() <= IN_PLACE | {DRAW} else None
    return timing.changed(made, name=name, fingerprint=fingerprint, shapes=shapes)


@cache
def _code() -> list[str]:
    """Digests of what makes pixels and truth: a changed line makes other sequences."""
    folder = Path(__file__).parent
    return [tree_digest(Path(str(module.__file__)), folder) for module in (timing, geometry, light)]
