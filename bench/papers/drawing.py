"""Pictures of a paper's report: written in the paper's order, and what is lacking."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.figures import write_figure
from reports.film_strip import write_film_strip

__all__ = ["undrawn", "write_pictures"]

_NUMBERED = re.compile(r"figure-(\d+)")


def write_pictures(
    folder: Path,
    plots: Mapping[str, Figure | NDArray[np.uint8] | None],
    strips: Mapping[str, NDArray[np.uint8]] | None = None,
) -> list[Path]:
    """Write pictures as PNG.

    Parameters
    ----------
    folder : Path
        Where to; made where it is not there.
    plots : mapping of str to Figure, ndarray of uint8 or None
        Plots and film strips by name, `figure-<number>` and what comes after it, or another; None
        is not written.
    strips : mapping of str to ndarray of uint8, optional
        Further film strips.

    Returns
    -------
    list of Path
        By the paper's numbers; pictures of our own come last.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, plot in {**plots, **(strips or {})}.items():
        file = folder / f"{name}.png"
        if isinstance(plot, Figure):
            paths.append(write_figure(file, plot))
        elif plot is not None:
            paths.append(write_film_strip(file, plot))
    return sorted(paths, key=_place)


def undrawn(pictures: Sequence[Path], numbers: Sequence[int]) -> list[str]:
    """What a reader must know of figures that there are no runs for, in a line or none.

    Parameters
    ----------
    pictures : sequence of Path
        What was written.
    numbers : sequence of int
        Of the paper's figures.
    """
    there = {path.stem for path in pictures}
    lacking = [str(number) for number in numbers if f"figure-{number}" not in there]
    return [f"Not drawn, for want of finished runs: Fig. {', '.join(lacking)}."] if lacking else []


def _place(path: Path) -> tuple[bool, int, str]:
    found = _NUMBERED.match(path.stem)
    return found is None, int(found[1]) if found else 0, path.stem
