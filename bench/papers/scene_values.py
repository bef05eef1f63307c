"""Measures of scenes without stored runs, computed in parallel and cached in files."""

import hashlib
import inspect
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from loky import get_reusable_executor
from numpy.typing import NDArray

from trackmark import datasets, trackers
from trackmark.datasets.source_digest import source_digest
from trackmark.reports.files import write_file

PACKAGE = Path(str(trackers.__file__)).parent

SceneFunction = Callable[..., float]
"""Function of the specification of a scene (or a number if there is no sequence) and the setting.

The values of a function without the parameter `setting` are equal in both settings.
"""


def scene_values(
    function: SceneFunction, scenes: Sequence[str], setting: str, folder: Path, jobs: int
) -> NDArray[np.float64]:
    """Return a measure of each scene (a specification) in a setting.

    `function`: function in a paper's `scenes.py`. `folder`: folder of cached values, which are
    valid until the scenes or the function's source change. `jobs`: number of worker processes.
    """
    settings = [setting] if "setting" in inspect.signature(function).parameters else []
    source = source_digest(Path(inspect.getfile(function)), PACKAGE)
    identities = [datasets.identity(scene) if "/" in scene else scene for scene in scenes]
    identity: list[Any] = [function.__name__, settings, identities, source]
    key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()[:16]
    file = folder / "scenes" / f"{key}.json"
    if file.is_file():
        return np.array(json.loads(file.read_bytes()))
    # Its processes also compute the next function: starting them takes seconds.
    pool = get_reusable_executor(max_workers=jobs)
    values = [*pool.map(function, scenes, *([name] * len(scenes) for name in settings))]
    text = json.dumps(values)
    write_file(file, lambda path: path.write_text(text, "utf-8"))
    return np.array(values)
