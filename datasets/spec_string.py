"""Specifications of trackers and sequences: `name:key=value:key=value`.

They are used on the command line, in labels and in results.
"""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

from trackmark.datasets.decoding import quote


def close_match(name: str, valid_names: Iterable[str]) -> str:
    """Return a hint on an unknown name: " Did you mean 'x'?", or an empty text."""
    close = get_close_matches(name, list(valid_names), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""


def name_hint(name: str, valid_names: Iterable[str]) -> str:
    """Return the closest match as `close_match` does, or all valid names if none is close."""
    names = list(valid_names)
    return close_match(name, names) or f" Known: {', '.join(names) or 'none'}."


def natural_order(name: str) -> tuple[list[str | int], str]:
    """Return a sort key in which digits are compared as numbers: `img2` before `img10`."""
    # Splitting at digits alternates text and numbers, so that equal types are compared.
    parts = re.split(r"([0-9]+)", name)
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], name


def parse_text(spec: str) -> tuple[str, dict[str, str]]:
    """Split a specification into its name and its options.

    Raises `ValueError` for an option without `=`, without a key, or given twice.

    Examples
    --------
    >>> parse_text("multipart/1:scene=2:light=even")
    ('multipart/1', {'scene': '2', 'light': 'even'})
    """
    name, *assignments = spec.strip().split(":")
    options: dict[str, str] = {}
    for assignment in assignments:
        key, equals, value = assignment.partition("=")
        if not (key and equals):
            raise ValueError(f"{quote(spec)}: {quote(assignment)} is not key=value.")
        if key in options:
            raise ValueError(f"{quote(spec)}: {quote(key)} is given twice.")
        options[key] = value
    return name, options


def format_text(name: str, options: Mapping[str, object]) -> str:
    """Return the specification of a name and its options, in their order.

    Examples
    --------
    >>> format_text("multipart", {"preset": "robust", "particles": 400, "adaptive": False})
    'multipart:preset=robust:particles=400:adaptive=false'
    """
    return ":".join([name, *(f"{key}={format_value(value)}" for key, value in options.items())])


def format_value(value: object) -> str:
    """Return the shortest text of a value."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return str(value)
