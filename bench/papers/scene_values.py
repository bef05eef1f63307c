"""Measures of scenes without stored runs, computed in parallel and cached in files."""

import hashlib
import inspect
import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets, trackers
from trackmark.bench.execution.pool import map_in_workers
from trackmark.bench.output_files import write_file
from trackmark.datasets.source_digest import source_digest

PACKAGE = Path(str(trackers.__file__)).parent

SceneFunction = Callable[..., float]
"""Function of the specification of a scene (or a number if there is no sequence) and of trackers.

Without trackers, its values are equal in both settings.
"""


def scene_values(
    function: SceneFunction,
    scenes: Sequence[str],
    trackers: Sequence[str],
    folder: Path,
    jobs: int,
) -> NDArray[np.float64]:
    """Return a measure of each scene; scenes and trackers are specifications.

    The `function` in a paper's `scenes.py` is called in `jobs` worker processes. Its values are
    cached in `folder` and remain valid until the scenes or the source of the function change.
    """
    fingerprints = [
        datasets.name_and_fingerprint(scene) if "/" in scene else scene for scene in scenes
    ]
    file = cache_file(folder / "scenes", function, [*trackers], fingerprints)
    if file.is_file():
        return np.array(json.loads(file.read_bytes()))
    values = [*map_in_workers(partial(_call, function, trackers), scenes, jobs)]
    write_file(file, json.dumps(values))
    return np.array(values)


def cache_file(folder: Path, function: Callable[..., Any], *arguments: Any) -> Path:
    """Return the file for values of a function, whose name changes with its source."""
    source = source_digest(Path(inspect.getfile(function)), PACKAGE)
    encoded = json.dumps([function.__name__, source, *arguments]).encode()
    return folder / f"{hashlib.sha256(encoded).hexdigest()[:16]}.json"


def _call(function: SceneFunction, trackers: Sequence[str], scene: str) -> float:
    return function(scene, *trackers)
