"""Whether the best samples of both features are brought together (section 1, MO-6)."""

from collections.abc import Iterator, Sequence

import numpy as np

from bench.papers.moreno2005.one_dimensional.cues import Filter, chain
from bench.papers.moreno2005.one_dimensional.settings import Course, Setting
from trackers.contours.cues.chain import Hypotheses

__all__ = ["SAMPLES", "association_rows", "best_pairs"]

SAMPLES = 100
TOP = 0.1

_KINDS: dict[str, Filter] = {"by-weight": "dependent", "uniform": "unweighted"}


def association_rows(
    setting: Setting, courses: Sequence[tuple[int, Course]]
) -> Iterator[dict[str, object]]:
    """Rows of the table `association`, but for the set's name; see the package.

    Parameters
    ----------
    setting : Setting
        Parameters.
    courses : sequence of (int, Course)
        By repetition.
    """
    for repetition, seen in courses:
        for name, kind in _KINDS.items():
            cues = chain(kind, setting, SAMPLES, seen.start)
            generator = np.random.default_rng([repetition, SAMPLES])
            found = [best_pairs(*cues.step(one, generator)) for one in seen.observed]
            best, top_pairs = np.mean(found, axis=0).tolist()
            yield {
                "repetition": repetition,
                "association": name,
                "best": best,
                "top_pairs": top_pairs,
            }


def best_pairs(colours: Hypotheses, positions: Hypotheses) -> tuple[float, float]:
    """Weight of the colour of the best position, in mean weights; share of pairs of the best."""
    assert positions.attached is not None
    number = len(colours.weights)
    best = colours.weights[positions.attached[positions.weights.argmax()]] * number
    ranks = colours.weights.argsort().argsort()
    top = positions.weights.argsort()[-round(TOP * len(positions.weights)) :]
    among_best = ranks[positions.attached[top]] >= number - round(TOP * number)
    return float(best), float(among_best.mean())
