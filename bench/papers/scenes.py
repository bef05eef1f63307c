"""What no run of a tracker shows: measured scene by scene, kept until scene or source change.

A paper's `scenes.py` lists `SceneCheck`s; short runs of trackers and frames as another camera
would give them stand at the end, for what they measure.
"""

import hashlib
import json
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

import datasets
import trackers
from bench.evaluation.loop import run_in_lock_step
from bench.evaluation.record import Run
from bench.evaluation.timing import Remembered
from bench.experiments.contestant import contestant
from bench.store.files import write_atomically
from datasets.interface import Image
from datasets.source_digest import source_digest
from datasets.text_form import parse_text

__all__ = [
    "SceneCheck",
    "Tables",
    "examined",
    "kept_tables",
    "measured_on_scenes",
    "short_runs",
    "spaced",
    "turned_about",
    "with_contrast",
    "with_gain",
    "with_noise",
]

T = TypeVar("T")
R = TypeVar("R")
Tables: TypeAlias = Mapping[str, pd.DataFrame]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Scenes measured for single claims"
MIDDLE = 128.0  # grey level about which contrast changes


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
        bare, _ = parse_text(name)
        for further in (False, True) if everything else (False,):
            chosen = tuple(
                one for one in checks if one.everything == further and bare in one.sequences
            )
            if chosen:
                canonical, fingerprint = datasets.identity(name)
                parts[canonical, chosen] = [canonical, fingerprint, digest, quick, further]
    return kept_tables(partial(_measured, quick=quick), parts, folder / "checks", jobs, TITLE)


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


def kept_tables(
    function: Callable[[T], Tables],
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


def examined(
    function: Callable[[T], R], scenes: Sequence[T], jobs: int, title: str
) -> Iterator[tuple[T, R]]:
    """What a function says of each scene, as it comes, from so many worker processes.

    The function and what it gives can be pickled; the title is that of a progress bar.
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


def short_runs(sequence: datasets.Sequence, texts: Sequence[str]) -> list[Run]:
    """Runs of trackers, by their text forms, made for one measurement and not kept; with arrays.

    Raises
    ------
    SequenceError
        Where one of them fails, with the tracker's text and the reason.
    """
    entries = [(contestant(text), 0) for text in texts]
    found = run_in_lock_step(entries, sequence, keep_arrays=True).runs
    for run in found:
        if run.failure:
            reason = run.failure.strip().splitlines()[0]
            raise datasets.SequenceError(
                f"{sequence.name}: {run.identity.tracker} failed: {reason}"
            )
    return found


def spaced(frames: NDArray[np.intp], most: int) -> list[int]:
    """At most so many of the frames, evenly spaced."""
    if len(frames) == 0:
        return []
    places = np.linspace(0, len(frames) - 1, most).round().astype(int)
    chosen: list[int] = np.unique(frames[places]).tolist()
    return chosen


def with_gain(image: Image, gain: float) -> Image:
    """Brighter or darker; what exceeds the camera's range is cut off."""
    return _as_bytes(image * np.float32(gain))


def with_contrast(image: Image, contrast: float) -> Image:
    """Less or more contrast about a middle grey."""
    middle = np.float32(MIDDLE)
    return _as_bytes(middle + (image - middle) * np.float32(contrast))


def with_noise(image: Image, deviation: float, generator: np.random.Generator) -> Image:
    """With Gaussian noise of a sensor, of this deviation in grey levels, in every channel."""
    noise = generator.standard_normal(image.shape, np.float32) * np.float32(deviation)
    return _as_bytes(image + noise)


def turned_about(image: Image, centre: NDArray[np.float64], degrees: float, way: int) -> Image:
    """Turned about a point [pixels] against the clock; beyond its rim the image is mirrored.

    `way` is how OpenCV interpolates.
    """
    x, y = (centre - 0.5).tolist()  # OpenCV puts pixel centres at whole numbers
    rotation = cv2.getRotationMatrix2D((x, y), degrees, 1.0)
    size = image.shape[1], image.shape[0]
    found = cv2.warpAffine(image, rotation, size, flags=way, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(found, np.uint8)


def _as_bytes(values: "np.ndarray[tuple[int, ...], np.dtype[np.floating]]") -> Image:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
