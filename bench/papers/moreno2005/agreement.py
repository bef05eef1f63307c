"""How far the compiled trackers are from the same methods in plain NumPy, with the same draws."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import datasets
import trackers
from bench.experiments.contestant import contestant, run_seed
from bench.papers.examination import kept_tables
from bench.papers.moreno2005.plain import PlainContourSmoothColor, PlainMoreno2005
from datasets.source_digest import source_digest

__all__ = ["WAYS", "agreement"]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Compiled against plain"
SEQUENCE = "moreno2005/ellipse:light=repeated"
FRAMES, QUICK_FRAMES = 10, 3
"""That are tracked after the first. A draw that rounding changed would change all after it."""

QUICK_SAMPLES = "plane_samples=10:colour_samples=50:contour_samples=80"
PLAIN: Mapping[str, type[Any]] = {
    "moreno2005": PlainMoreno2005,
    "contour-smooth-color": PlainContourSmoothColor,
}
WAYS = {
    "moreno2005:preset=as-written": "as written",
    "moreno2005": "recommended",
    "moreno2005:preset=robust": "robust",
    "moreno2005:association=uniform": "uniform association",
    "contour-smooth-color:preset=as-written": "baseline as written, a = 1",
    "contour-smooth-color:mixing=0.5:plane=refitted": "baseline, a = 0.5, plane refitted",
}
"""Words for the trackers that are compared, by their text forms."""


def agreement(folder: Path, jobs: int, *, quick: bool = False) -> pd.DataFrame:
    """Track with both, or look up what was found before.

    Parameters
    ----------
    folder : Path
        Keeps what was found, in `agreement/`.
    jobs : int
        Worker processes.
    quick : bool
        Few frames, with few samples.

    Returns
    -------
    DataFrame
        A row a tracker: `tracker` (a key of `WAYS`), `frames`; greatest differences over them of
        `contours` (mean contours, and the snake's) [pixels], `posteriors`, and the contours'
        `weights`.
    """
    digest = source_digest(Path(__file__), PACKAGE)
    shown = datasets.load(SEQUENCE).fingerprint
    identities = {text: [text, quick, shown, digest] for text in WAYS}
    compare = partial(_compared, quick=quick)
    return kept_tables(compare, identities, folder / "agreement", jobs, TITLE)["agreement"]


def _compared(text: str, quick: bool) -> Mapping[str, pd.DataFrame]:
    sequence = datasets.load(SEQUENCE)
    few = quick and text.startswith("moreno2005")
    chosen = contestant(f"{text}:{QUICK_SAMPLES}" if few else text)
    seed = run_seed(chosen.name, sequence.name, 0)
    compiled: Any = chosen.make(seed)
    plain = PLAIN[chosen.name](seed, **chosen.parameters)
    for one in (compiled, plain):
        one.init(sequence[0], sequence.boxes[0], sequence.mask(0))
    row: dict[str, Any] = {"tracker": text, "frames": QUICK_FRAMES if quick else FRAMES}
    row |= dict.fromkeys(("contours", "posteriors", "weights"), 0.0)
    for frame in range(1, row["frames"] + 1):
        ours, theirs = compiled.update(sequence[frame]).arrays, plain.update(sequence[frame])
        for name, one, other in (
            ("contours", ours["contour"], theirs.contour),
            ("contours", ours["mean_contour"], theirs.mean_contour),
            ("posteriors", ours["posterior"], theirs.posterior),
            ("weights", compiled.contours.weights, plain.contours.weights),
        ):
            row[name] = max(row[name], float(np.abs(one - other).max()))
    return {"agreement": pd.DataFrame([row])}
