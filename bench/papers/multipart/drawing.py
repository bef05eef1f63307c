"""Which scenes are run: as many are drawn as it takes for enough of them to pass the static gate.

`python -m bench.papers.multipart.drawing` examines scenes in the order of their numbers, sequence
by sequence and light by light, and writes `scenes.csv`. The experiment `table-1` names those that
pass, `dropped` the others; a test compares both with the log. No tracker runs here.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import count
from typing import Any

import pandas as pd

import datasets
from bench.papers.multipart.scenes import LOG, examined_scene, passes, read_log, write_log
from bench.papers.scenes import examined
from datasets.text_form import format_text

__all__ = ["LIGHTS", "MOST", "PASSING", "SEQUENCES", "drawn", "name_of", "numbers"]

PASSING = 6
"""Scenes of a sequence that are wanted in each light, twelve in all: where all runs of ten
scenes are kept, the interval of that share still reaches below the three quarters that are asked
for."""

MOST = 100
"""Scenes of a sequence that are drawn in a light before giving up."""

LIGHTS = ("even", "dappled")
SEQUENCES = tuple(f"multipart/{number}" for number in range(1, 9))

Row = Mapping[Any, Any]
Known = dict[tuple[str, str], Row]


def numbers(light: str) -> Iterator[int]:
    """Numbers of the scenes of a light, without end: 0 to 3 are even, 4 to 7 dappled, and so on.

    No number is in both lights, so that scenes in either are cells of their own.
    """
    return (number for number in count() if (number % 8 < 4) == (light == "even"))


def name_of(sequence: str, light: str, number: int) -> str:
    """Canonical name of a scene: knobs that are at their default are not told."""
    told = {"light": light, "scene": str(number)}
    return format_text(sequence, {k: v for k, v in told.items() if v not in ("even", "0")})


def drawn(sequence: str, light: str, examine: Callable[[str], Row]) -> list[Row]:
    """Draw scenes until `PASSING` of them pass the gate.

    Parameters
    ----------
    sequence, light : str
        Name without variant, and one of `LIGHTS`.
    examine : callable
        Gives the log's row of a scene, by its name.

    Returns
    -------
    list of dict
        Rows of all that were drawn, in order; the last one passes.

    Raises
    ------
    RuntimeError
        Where `MOST` scenes are not enough.
    """
    rows: list[Row] = []
    passing = 0
    for number in numbers(light):
        if passing == PASSING:
            return rows
        if len(rows) == MOST:
            break
        rows.append(examine(name_of(sequence, light, number)))
        passing += bool(passes(pd.DataFrame(rows[-1:])).iloc[0])
    words = f"only {passing} of {MOST} scenes of {sequence} in {light} light pass the static gate"
    raise RuntimeError(f"{words}, and {PASSING} are needed: design the scenes or the gate anew.")


def _examined(name: str, known: Known) -> Row:
    """As the log has it, where it is of this version of the scene."""
    row = known.get((name, datasets.load(name).fingerprint))
    return examined_scene(name) if row is None else row


def _drawn(which: tuple[str, str], known: Known) -> list[Row]:
    return drawn(*which, partial(_examined, known=known))


def main() -> None:
    """Draw all scenes, and write the log."""
    log = read_log(LOG).to_dict("records")
    known: Known = {(row["name"], row["fingerprint"]): row for row in log}
    wanted = [(sequence, light) for sequence in SEQUENCES for light in LIGHTS]
    function = partial(_drawn, known=known)
    found = dict(examined(function, wanted, os.cpu_count() or 1, "Scenes drawn"))
    write_log(LOG, pd.DataFrame([row for which in wanted for row in found[which]]))


if __name__ == "__main__":
    main()
