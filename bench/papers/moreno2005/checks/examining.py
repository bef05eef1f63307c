"""All that is measured on scenes, and on which of them."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from bench.papers.moreno2005.checks import edges, modules, separability
from bench.papers.scene_checks import SceneCheck, measured_on_scenes

__all__ = ["examine"]

OCTOPUS = ("moreno2005/octopus",)
ALL = tuple(f"moreno2005/{name}" for name in ("ellipse", "octopus", "book", "leaf"))

CHECKS = (
    SceneCheck(modules.measure, OCTOPUS),
    SceneCheck(separability.measure, ALL),
    SceneCheck(edges.measure, ALL),
)


def examine(
    scenes: Sequence[str], folder: Path, jobs: int, quick: bool = False, everything: bool = False
) -> dict[str, pd.DataFrame]:
    """Measure on scenes what the package says; see `measured_on_scenes`."""
    return measured_on_scenes(
        CHECKS, Path(__file__), scenes, folder, jobs, quick=quick, everything=everything
    )
