"""What no run of a tracker shows, measured scene by scene; kept until scene or source change."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import pandas as pd

import datasets
import trackers
from bench.papers.examination import kept_tables
from datasets.interface import Frames, Image
from datasets.source_digest import source_digest
from datasets.text_form import parse_text

__all__ = ["Remembered", "SceneCheck", "Tables", "measured_on_scenes"]

Tables: TypeAlias = Mapping[str, pd.DataFrame]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Scenes measured for single claims"


@dataclass(frozen=True)
class SceneCheck:
    """Something that is measured on a scene.

    Attributes
    ----------
    measure : callable
        Gives tables by name, of a sequence; shorter ones where the second argument is true.
    sequences : tuple of str
        Those on which it is measured, without variant.
    everything : bool
        Whether it is measured only where everything is asked for.
    """

    measure: Callable[[datasets.Sequence, bool], Tables]
    sequences: tuple[str, ...]
    everything: bool = False


class Remembered:
    """Frames that are rendered once, as every check asks for the same ones.

    Parameters
    ----------
    frames : Frames
        Where they come from.
    """

    def __init__(self, frames: Frames) -> None:
        self.frames = frames
        self._seen: dict[int, Image] = {}

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, frame: int) -> Image:
        if frame not in self._seen:
            self._seen[frame] = self.frames[frame]
        return self._seen[frame]


def measured_on_scenes(
    checks: Sequence[SceneCheck],
    source: Path,
    scenes: Sequence[str],
    folder: Path,
    jobs: int,
    *,
    quick: bool = False,
    everything: bool = False,
) -> dict[str, pd.DataFrame]:
    """Measure on scenes, or look up what was measured before.

    Parameters
    ----------
    checks : sequence of SceneCheck
        What is measured.
    source : Path
        Module that imports all that measures.
    scenes : sequence of str
        Names of sequences; nothing is measured on those that no check names.
    folder : Path
        Keeps what was measured, in `checks/`, by the scene's fingerprint and by the source of
        all that measures.
    jobs : int
        Worker processes.
    quick : bool
        Shorter tables: a look at whether it works.
    everything : bool
        Also what is only measured then.

    Returns
    -------
    dict of str to DataFrame
        Tables by name, rows in the order of the scenes, with `name` (canonical), `sequence`
        (without variant) and `scene` before columns of their own; none without a row.

    Raises
    ------
    SequenceError
        For a sequence that is unknown, and where a tracker fails.
    """
    digest = source_digest(source, PACKAGE)
    parts = {}
    for name in scenes:
        for further in (False, True) if everything else (False,):
            chosen = _chosen(checks, name, further)
            if chosen:  # only then is it worth the time to make a scene
                sequence = datasets.load(name)
                identity = [sequence.name, sequence.fingerprint, digest, quick, further]
                parts[sequence.name, chosen] = identity
    return kept_tables(partial(_measured, quick=quick), parts, folder / "checks", jobs, TITLE)


def _chosen(checks: Sequence[SceneCheck], name: str, everything: bool) -> tuple[SceneCheck, ...]:
    """What is measured on a sequence, always or only where everything is asked for."""
    bare, _ = parse_text(name)
    return tuple(one for one in checks if one.everything == everything and bare in one.sequences)


def _measured(part: tuple[str, tuple[SceneCheck, ...]], quick: bool) -> Tables:
    """All tables of a sequence that have a row."""
    name, checks = part
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
        for check in checks
        for table, rows in check.measure(sequence, quick).items()
        if len(rows)
    }
