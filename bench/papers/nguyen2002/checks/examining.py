"""All that is measured on scenes, and on which of them."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from bench.papers.nguyen2002.checks import (
    adapting,
    changed,
    clutter,
    contamination,
    corners,
    norms,
    sensor,
    shading,
    sliding,
    watching,
)
from bench.papers.scene_checks import SceneCheck, measured_on_scenes
from datasets.text_form import parse_text

__all__ = ["examine"]

LIGHTS = "nguyen2002/lights"
CLIPS = tuple(f"nguyen2002/clip-{number:02}" for number in range(1, 21, 2))
"""Every other one is enough where a set is the unit."""

OTHERS = tuple(f"nguyen2002/clip-{number:02}" for number in range(2, 21, 2))
BOTH = (*CLIPS, LIGHTS)
QUICK = (*CLIPS[::2], LIGHTS)

CHECKS = (
    SceneCheck(clutter.measure, CLIPS),
    SceneCheck(watching.measure, CLIPS),
    SceneCheck(sliding.measure, CLIPS[:1]),
    SceneCheck(shading.measure, (LIGHTS,)),
    SceneCheck(clutter.measure, OTHERS, everything=True),
    SceneCheck(watching.measure, OTHERS, everything=True),
    SceneCheck(contamination.measure, BOTH, everything=True),
    SceneCheck(corners.measure, CLIPS, everything=True),
    SceneCheck(changed.measure, BOTH, everything=True),
    SceneCheck(adapting.measure, BOTH, everything=True),
    SceneCheck(sliding.measure_on_targets, BOTH, everything=True),
    SceneCheck(norms.measure, BOTH, everything=True),
    SceneCheck(sensor.measure, CLIPS, everything=True),
)


def examine(
    scenes: Sequence[str], folder: Path, jobs: int, quick: bool = False, everything: bool = False
) -> dict[str, pd.DataFrame]:
    """Measure on scenes what the package says; see `measured_on_scenes`.

    A quick look is one at fewer clips.
    """
    if quick:
        scenes = [name for name in scenes if parse_text(name)[0] in QUICK]
    return measured_on_scenes(
        CHECKS, Path(__file__), scenes, folder, jobs, quick=quick, everything=everything
    )
