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
from bench.papers.wang2010.checks import (
    averaging,
    camera,
    contrast,
    drift,
    gating,
    illumination,
    recovery,
    threshold,
    weights,
    window,
)
from bench.papers.wang2010.checks.remembered import Remembered
from datasets.source_digest import source_digest
from datasets.text_form import parse_text

__all__ = ["examine"]

Tables = Mapping[str, pd.DataFrame]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Scenes measured for single claims"
OURS = ("wang2010/table-tennis", "wang2010/hand", "wang2010/cup")


@dataclass(frozen=True)
class Check:
    """Something that is measured on a scene.

    Attributes
    ----------
    measure : callable
        Gives tables by name, of a sequence; shorter ones where the second argument is true.
    sequences : tuple of str
        Those on which it is measured.
    everything : bool
        Whether it is measured only where everything is asked for.
    """

    measure: Callable[[datasets.Sequence, bool], Tables]
    sequences: tuple[str, ...] = OURS
    everything: bool = False


CHECKS = (
    Check(contrast.measure),
    Check(gating.measure),
    Check(drift.measure),
    Check(weights.measure),
    Check(camera.measure, OURS + camera.MOVING_CAMERA),
    Check(illumination.measure, everything=True),
    Check(window.measure, everything=True),
    Check(averaging.measure, everything=True),
    Check(threshold.measure, everything=True),
    Check(recovery.measure, everything=True),
)


def examine(
    scenes: Sequence[str], folder: Path, jobs: int, quick: bool = False, everything: bool = False
) -> dict[str, pd.DataFrame]:
    """Measure on scenes what the package says, or look up what was measured before.

    Parameters
    ----------
    scenes : sequence of str
        Names of sequences of the suite, and of `MOVING_CAMERA`; nothing is measured on others.
    folder : Path
        Keeps what was measured, in `checks/`, by the scene's fingerprint and by the source of
        all that measures.
    jobs : int
        Worker processes.
    quick : bool
        Fewer frames and starts: a look at whether it works.
    everything : bool
        Also what is only measured then.

    Returns
    -------
    dict of str to DataFrame
        Tables by name, rows in the order of the scenes; none without a row.

    Raises
    ------
    SequenceError
        For a sequence that is unknown, and where a tracker fails.
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
    bare, _ = parse_text(name)
    return [check for check in CHECKS if check.everything == further and bare in check.sequences]


def _measured(part: tuple[str, bool], quick: bool) -> Tables:
    """All tables of a sequence that have a row."""
    name, further = part
    sequence = datasets.load(name)
    sequence.frames = Remembered(sequence.frames)
    bare, options = parse_text(sequence.name)
    labels: dict[str, Any] = {
        "name": sequence.name,
        "sequence": bare,
        "scene": int(options.get("scene", 0)),
    }
    return {
        table: rows.assign(**labels)[[*labels, *rows.columns]]
        for check in _chosen(name, further)
        for table, rows in check.measure(sequence, quick).items()
        if len(rows)
    }
