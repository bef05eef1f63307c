"""All that is measured on scenes: scene by scene, kept on disk until scene or source change."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

import datasets
import trackers
from bench.papers.examination import kept_tables
from bench.papers.nummiaro2003.checks import (
    background,
    entrance,
    kernels,
    lighting,
    maximum,
    mixture,
    noise,
    occlusion,
    own_models,
    transformed,
)
from datasets.source_digest import source_digest
from datasets.text_form import parse_text

__all__ = ["examine"]

Tables = Mapping[str, pd.DataFrame]

PACKAGE = Path(str(trackers.__file__)).parent
SUITE = "nummiaro2003/"
TITLE = "Scenes measured for single claims"
EVERY = ("person", "car", "students", "traffic", "head")


@dataclass(frozen=True)
class Check:
    """Something that is measured on a scene.

    Attributes
    ----------
    measure : callable
        Gives tables by name, of a sequence; shorter ones where the second argument is true.
    sequences : tuple of str
        Those on which it is measured, without the suite's name.
    everything : bool
        Whether it is measured only where everything is asked for.
    empty_start : bool
        Whether it is for scenes that begin without the target, or for all others.
    """

    measure: Callable[[datasets.Sequence, bool], Tables]
    sequences: tuple[str, ...] = EVERY
    everything: bool = False
    empty_start: bool = False

    def suits(self, name: str) -> bool:
        """Whether it is measured on a sequence."""
        bare, options = parse_text(name)
        empty_start = options.get("start") == "empty"
        return bare.removeprefix(SUITE) in self.sequences and empty_start == self.empty_start


CHECKS = (
    Check(background.measure),
    Check(occlusion.measure, ("students",)),
    Check(transformed.measure),
    Check(kernels.measure),
    Check(maximum.measure, ("person",)),
    Check(entrance.measure, ("person",), empty_start=True),
    Check(entrance.measure_kick_offs, ("person",), everything=True, empty_start=True),
    Check(lighting.measure, everything=True),
    Check(own_models.measure, ("students",), everything=True),
    Check(noise.measure, ("person",), everything=True),
    Check(mixture.measure, everything=True),
)


def examine(
    scenes: Sequence[str], folder: Path, jobs: int, quick: bool = False, everything: bool = False
) -> dict[str, pd.DataFrame]:
    """Measure on scenes what the package says, or look up what was measured before.

    Parameters
    ----------
    scenes : sequence of str
        Names of sequences of the suite; `entrance` is measured on `person:start=empty`.
    folder : Path
        Keeps what was measured, in `checks/`, by the scene's fingerprint and by the source of
        all that measures.
    jobs : int
        Worker processes.
    quick : bool
        Fewer frames and repetitions: a look at whether it works.
    everything : bool
        Also what is only measured then.

    Returns
    -------
    dict of str to DataFrame
        Tables by name, rows in the order of the scenes; none without a row.

    Raises
    ------
    SequenceError
        For a sequence that is unknown.
    """
    source = source_digest(Path(__file__), PACKAGE)
    identities = {
        (sequence.name, further): [sequence.name, sequence.fingerprint, source, quick, further]
        for sequence in map(datasets.load, scenes)
        for further in ((False, True) if everything else (False,))
        if any(_chosen(sequence.name, further))
    }
    return kept_tables(partial(_measured, quick=quick), identities, folder / "checks", jobs, TITLE)


def _chosen(name: str, further: bool) -> list[Check]:
    """What is measured on a sequence, always or only where everything is asked for."""
    return [check for check in CHECKS if check.everything == further and check.suits(name)]


def _measured(part: tuple[str, bool], quick: bool) -> Tables:
    """All tables of a sequence that have a row."""
    name, further = part
    sequence = datasets.load(name)
    bare, options = parse_text(sequence.name)
    labels: dict[str, Any] = {
        "name": sequence.name,
        "sequence": bare,
        "scene": int(options.get("scene", 0)),
        "light": options.get("light", "even"),
    }
    return {
        table: rows.assign(**labels)[[*labels, *rows.columns]]
        for check in _chosen(name, further)
        for table, rows in check.measure(sequence, quick).items()
        if len(rows)
    }
