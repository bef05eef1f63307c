"""Examining scenes one by one in processes of their own, before or beside the trackers' runs."""

import hashlib
import json
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import TypeVar

import pandas as pd

from bench.papers import Effort
from bench.store.files import write_atomically

__all__ = ["examined", "examined_for", "kept_tables"]

T = TypeVar("T")
R = TypeVar("R")


def examined_for(
    effort: Effort,
    examine: Callable[..., dict[str, pd.DataFrame]],
    scenes: Sequence[str],
    folder: Path,
) -> dict[str, pd.DataFrame]:
    """What a paper's `examine` measures on scenes, as far as an effort goes.

    Parameters
    ----------
    effort : Effort
        How much is asked for.
    examine : callable
        `examine(scenes, folder, jobs, quick=…, everything=…)` of the paper's `checks`.
    scenes : sequence of str
        Names of sequences.
    folder : Path
        Of the report; made if need be, keeps what was measured.
    """
    folder.mkdir(parents=True, exist_ok=True)
    jobs = effort.jobs or os.cpu_count() or 1
    return examine(scenes, folder, jobs, quick=effort.quick, everything=effort.everything)


def examined(
    function: Callable[[T], R], scenes: Sequence[T], jobs: int, title: str
) -> Iterator[tuple[T, R]]:
    """What a function says of each scene, as it comes; with a progress bar.

    Parameters
    ----------
    function : callable
        Takes one scene; it and what it gives can be pickled.
    scenes : sequence
        What it is asked of.
    jobs : int
        Worker processes.
    title : str
        Of the bar.
    """
    from loky import ProcessPoolExecutor
    from tqdm import tqdm

    if not scenes:
        return
    executor = ProcessPoolExecutor(max_workers=min(jobs, len(scenes)))
    with warnings.catch_warnings():
        # Workers keep textures of the scenes that they saw; loky replaces those that grow.
        warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
        try:
            futures = {executor.submit(function, scene): scene for scene in scenes}
            ended = as_completed(futures)
            for future in tqdm(ended, title, len(futures), unit="scene", disable=None, delay=1.0):
                yield futures[future], future.result()
        finally:
            executor.shutdown(wait=True, kill_workers=True)


def kept_tables(
    function: Callable[[T], Mapping[str, pd.DataFrame]],
    identities: Mapping[T, object],
    folder: Path,
    jobs: int,
    title: str,
) -> dict[str, pd.DataFrame]:
    """Tables that a function makes of each scene, or made of it before.

    Parameters
    ----------
    function : callable
        As for `examined`; gives tables by name.
    identities : mapping
        Scenes, and all that their tables depend on, as JSON knows it.
    folder : Path
        Keeps the tables.
    jobs, title
        As for `examined`.

    Returns
    -------
    dict of str to DataFrame
        Tables by name, rows in the order of the scenes.
    """
    files = {}
    for scene, identity in identities.items():
        key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]
        files[scene] = folder / f"{key}.json"
    left = [scene for scene, file in files.items() if not file.is_file()]
    for scene, tables in examined(function, left, jobs, title):
        content = {name: table.to_dict("list") for name, table in tables.items()}
        write_atomically(files[scene], json.dumps(content).encode())
    found: dict[str, list[pd.DataFrame]] = {}
    for file in files.values():
        for name, columns in json.loads(file.read_bytes()).items():
            found.setdefault(name, []).append(pd.DataFrame(columns))
    return {name: pd.concat(tables, ignore_index=True) for name, tables in found.items()}
