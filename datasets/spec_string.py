"""The text form of a thing with options: `name:key=value:key=value`.

Trackers and sequences are both written so, on the command line, in labels and in results.
"""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches

from trackmark.datasets.decoding import quote


def close_match(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: " Did you mean 'x'?", or nothing."""
    close = get_close_matches(name, list(known), n=1)
    return f" Did you mean {close[0]!r}?" if close else ""


def natural_order(name: str) -> tuple[list[str | int], str]:
    """A key to sort by: numbers in names count as such, `img2` comes before `img10`."""
    # Splitting at digits gives text and numbers in turn, so that like meets like.
    parts = re.split(r"([0-9]+)", name)
    return [int(part) if i % 2 else part for i, part in enumerate(parts)], name


def parse_text(text: str) -> tuple[str, dict[str, str]]:
    """Split a text form into its name and its options.

    Raises `ValueError` for an option without `=`, without a key, or given twice.

    Examples
    --------
    >>> parse_text("multipart/1:scene=2:light=even")
    ('multipart/1', {'scene': '2', 'light': 'even'})
    """
    name, *parts = text.strip().split(":")
    options: dict[str, str] = {}
    for part in parts:
        key, equals, value = part.partition("=")
        if not (key and equals):
            raise ValueError(f"{quote(text)}: {quote(part)} is not key=value.")
        if key in options:
            raise ValueError(f"{quote(text)}: {quote(key)} is given twice.")
        options[key] = value
    return name, options


def format_text(name: str, options: Mapping[str, object]) -> str:
    """Write a name and its options, in the order given.

    Examples
    --------
    >>> format_text("multipart", {"preset": "robust", "particles": 400, "adaptive": False})
    'multipart:preset=robust:particles=400:adaptive=false'
    """
    return ":".join([name, *(f"{key}={_value(value)}" for key, value in options.items())])


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return str(value)
