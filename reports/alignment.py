"""Where cells of tables stand: texts to the left, numbers with their units beneath each other."""

import re
from typing import NamedTuple

from trackmark.reports.tables import MISSING, Table

_NEVER = "none"  # in place of the number of a frame
_NUMBER = re.compile(
    r"([\[(~<>≤≥]*\s*[+-]?\d*)(?:(?<=\d)\.?\d*|\.\d+)(?:e[+-]?\d+)?(?=$|[\s,;%\])±–*])",
    re.IGNORECASE | re.ASCII,
)


class Number(NamedTuple):
    """A text that begins with a number, in two parts: up to its units, and what follows them."""

    whole: str
    rest: str


def number_in(text: str) -> Number | None:
    """The parts of a text that begins with a number: `~3.1`, `[-0.2, 0.1]`, `54 of 99`.

    >>> number_in("0.784 ±0.204")
    Number(whole='0', rest='.784 ±0.204')
    """
    found = _NUMBER.match(text)
    return Number(found[1], text[found.end(1) :]) if found else None


def texts_of(table: Table) -> list[bool]:
    """Which columns have texts: labels, and those most of whose cells begin with no number.

    Cells with several statements (`0 of 2; fragile`) are texts, whatever they begin with.
    """
    found = []
    for column in range(len(table.heads)):
        cells = [row[column].text for row in table.rows]
        known = [text for text in cells if text not in ("", _NEVER) and text[0] != MISSING]
        numbers = sum(number_in(text) is not None for text in known)
        told = any(";" in text for text in known)
        found.append(column < table.n_labels or told or 2 * numbers < len(known))
    return found


def rests_of(table: Table) -> list[set[str]]:
    """Of each column of numbers what follows their units; empty where all are as long.

    So nothing need be done to such a column, and to one of texts, but to set it left or right.
    """
    found = []
    for column, text in enumerate(texts_of(table)):
        cells = [] if text else [number_in(row[column].text) for row in table.rows]
        rests = {one.rest for one in cells if one is not None}
        found.append(rests if len({*map(len, rests)}) > 1 else set())
    return found
