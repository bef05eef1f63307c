"""Times that methods took side by side, kept beside the report until what is timed changes."""

import hashlib
import json
import platform
from collections.abc import Callable
from pathlib import Path

import pandas as pd

import datasets
import trackers
from bench.papers.wang2010 import costs
from bench.store.files import write_atomically
from datasets.source_digest import source_digest

__all__ = ["kept_times"]

PACKAGE = Path(str(trackers.__file__)).parent

PASSES, FRAMES = 10, 60
QUICK_PASSES, QUICK_FRAMES = 2, 8

_MEASURED = {"disturbed", "seconds", "motion", *costs.METHODS}


def kept_times(
    names: tuple[str, ...], by_number: str, folder: Path, *, quick: bool = False
) -> dict[str, pd.DataFrame]:
    """Measure what `costs` does, or look up what this machine measured before.

    What other load disturbed too often is measured anew the next time.

    Parameters
    ----------
    names : tuple of str
        Sequences on which all methods are timed.
    by_number : str
        That on which both filters are, by their number of particles.
    folder : Path
        Keeps the times, by the sequences, the source of what is timed and the machine.
    quick : bool
        Few frames and passes.

    Returns
    -------
    dict of str to DataFrame
        `method_times` and `particle_times` of `costs`, disturbed passes among them.
    """
    passes, frames = (QUICK_PASSES, QUICK_FRAMES) if quick else (PASSES, FRAMES)
    fewer = max(passes // 2, 1)  # each is of many numbers
    return {
        "method_times": _kept(
            folder,
            ["method_times", *_identity(names), passes, frames],
            lambda: costs.method_times(names, passes, frames),
            passes,
        ),
        "particle_times": _kept(
            folder,
            ["particle_times", *_identity((by_number,)), fewer, frames],
            lambda: costs.particle_times(by_number, fewer, frames),
            fewer,
        ),
    }


def _identity(names: tuple[str, ...]) -> list[object]:
    """What times depend on, as JSON knows it."""
    shown = [[name, datasets.load(name).fingerprint] for name in names]
    source = source_digest(Path(costs.__file__), PACKAGE)
    return [shown, source, platform.platform(), platform.node()]


def _kept(
    folder: Path, identity: list[object], measure: Callable[[], pd.DataFrame], passes: int
) -> pd.DataFrame:
    key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]
    file = folder / f"{key}.json"
    if file.is_file():
        return pd.DataFrame(json.loads(file.read_bytes()))
    times = measure()
    ways = [column for column in times if column not in _MEASURED]
    quiet = (times["disturbed"] == 0).groupby([times[column] for column in ways]).sum()
    if quiet.min() >= passes:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(file, json.dumps(times.to_dict("list")).encode())
    return times
