"""What is measured of the one-dimensional example, kept until its source changes; equation 2.

    measure(folder, jobs, quick=False) -> dict[str, DataFrame]

- `one-dimensional-errors`: a row a set of parameters (`set`), `samples`, `repetition` and `filter`
  (`observation`, `independent`, `dependent`, `unweighted`): `error` (the distance to the truth in
  the plane of position and colour), `position_error`, `colour_error` (with the colours attached to
  positions, by the positions' weights), `own_error`, `own_colour_error` (with the colour filter's
  own estimate instead), `effective` (effective sample size of the positions, as a share), all of
  them means over frames. Truth and observations of a repetition are the same for all filters and
  numbers.
- `one-dimensional-differences`: paired, over repetitions, a row a set, number, `pair` (as
  `independent less dependent`) and `quantity` (`error`, `position_error`, …): `mean`,
  `standard_error`, limits of the 95 % interval (`lower_limit`, `upper`).
- `one-dimensional-trends`: a row a set and filter: `rank_correlation` (of mean error and number),
  and the limits of the interval of error(10) less error(500).
- `one-dimensional-association`: a row a set, repetition and `association` (`by-weight`,
  `uniform`): `best` (weight of the colour that the best position has, in units of the mean weight),
  `top_pairs` (share of the best tenth of the positions whose colour is among the best tenth), means
  over frames.
- `one-dimensional-factorisation`: a row a `dependence` of a discrete model: `distance` (total
  variation between the posterior and the product of equation 2).

All have `scale` (λ of the weights) where they have `set`.
"""

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import trackers
from bench.papers.moreno2005.example import (
    FILTERS,
    FRAMES,
    NUMBERS,
    SETTINGS,
    Course,
    Filter,
    chain,
    course,
    estimates,
)
from bench.papers.scenes import kept_tables
from bench.statistics.intervals import mean_interval
from datasets.source_digest import source_digest
from trackers.contours.chain import Hypotheses

__all__ = ["DEPENDENCES", "STATES", "best_pairs", "differences", "distance", "factorisation"]
__all__ += ["joint", "measure", "trends"]

Array: TypeAlias = NDArray[np.float64]

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Section 3, one dimension"

REPETITIONS, ASSOCIATIONS = 200, 20
QUICK_REPETITIONS, QUICK_ASSOCIATIONS, QUICK_NUMBERS = 20, 4, (10, 50, 200, 500)

QUANTITIES = ("error", "position_error", "colour_error", "own_error", "own_colour_error")
PAIRS = (
    ("independent", "dependent"),
    ("observation", "independent"),
    ("observation", "dependent"),
    ("unweighted", "dependent"),
)
"""Filters whose errors are compared: first less second."""

FEW, MANY = 10, 500

ASSOCIATED = 100  # samples of either feature
TOP = 0.1
_ASSOCIATIONS: Mapping[str, Filter] = {"by-weight": "dependent", "uniform": "unweighted"}

DEPENDENCES = ("equation 1 alone", "and p(x₁ | z₁, z₂) = p(x₁ | z₁)")
"""What is assumed: as the paper writes, and what its proof needs besides."""

STATES = 4  # of every feature and measurement
MODELS = 100

_KEYS = ["set", "scale", "samples"]


class _Part(NamedTuple):
    """What one process measures at a time; -1 stands for the association."""

    setting: str
    samples: int


def measure(folder: Path, jobs: int, quick: bool = False) -> dict[str, pd.DataFrame]:
    """Simulate, or look up what was simulated before.

    Parameters
    ----------
    folder : Path
        Keeps what was measured, in `one-dimensional/`.
    jobs : int
        Worker processes.
    quick : bool
        Fewer numbers and repetitions: a look at whether it works.
    """
    digest = source_digest(Path(__file__), PACKAGE)
    repetitions, associations, numbers = (
        (QUICK_REPETITIONS, QUICK_ASSOCIATIONS, QUICK_NUMBERS)
        if quick
        else (REPETITIONS, ASSOCIATIONS, NUMBERS)
    )
    # The longest come first, so that no process is left alone with one in the end.
    parts = [_Part(name, number) for number in sorted(numbers)[::-1] for name in SETTINGS]
    parts += [_Part(name, -1) for name in SETTINGS]
    identities = {part: [*part, repetitions, associations, digest] for part in parts}
    measured = partial(_measured, repetitions=repetitions, associations=associations)
    tables = kept_tables(measured, identities, folder / "one-dimensional", jobs, TITLE)
    errors = tables["errors"].sort_values(_KEYS, kind="stable", ignore_index=True)
    found = {
        "errors": errors,
        "differences": differences(errors),
        "trends": trends(errors),
        "association": tables["association"],
        "factorisation": factorisation(),
    }
    return {f"one-dimensional-{name}": table for name, table in found.items()}


def differences(errors: pd.DataFrame) -> pd.DataFrame:
    """Paired differences of errors; see the module."""
    return pd.DataFrame(
        {
            **dict(zip(_KEYS, keys, strict=True)),
            "pair": f"{first} less {second}",
            "quantity": quantity,
            **_limits(by_filter[first] - by_filter[second]),
        }
        for keys, rows in errors.groupby(_KEYS, sort=False)
        for quantity in QUANTITIES
        for by_filter in [rows.pivot_table(quantity, "repetition", "filter", dropna=False)]
        for first, second in PAIRS
        if {first, second} <= set(by_filter)
    )


def trends(errors: pd.DataFrame) -> pd.DataFrame:
    """How errors go on with the number of samples; see the module."""
    filters = errors[errors["filter"] != "observation"]
    rows = []
    for (name, scale, kind), part in filters.groupby(["set", "scale", "filter"], sort=False):
        means = part.groupby("samples")["error"].mean()
        by_number = part.pivot_table("error", "repetition", "samples")
        rows.append(
            {"set": name, "scale": scale, "filter": kind}
            | {"rank_correlation": means.corr(means.index.to_series(), method="spearman")}
            | _limits(by_number[FEW] - by_number[MANY])
        )
    return pd.DataFrame(rows)


def _limits(values: "pd.Series[float]") -> dict[str, float]:
    interval = mean_interval(values)
    return {
        "mean": float(values.mean()),
        "standard_error": float(values.std() / np.sqrt(len(values))),
        "lower_limit": interval.low,
        "upper": interval.high,
    }


def _measured(part: _Part, repetitions: int, associations: int) -> Mapping[str, pd.DataFrame]:
    labels = {"set": part.setting, "scale": f"{SETTINGS[part.setting].scale:g}"}
    if part.samples < 0:
        rows = _association_rows(part.setting, associations)
        return {"association": pd.DataFrame(rows).assign(**labels)}
    rows = _error_rows(part.setting, part.samples, repetitions)
    return {"errors": pd.DataFrame(rows).assign(samples=part.samples, **labels)}


def _course_of(name: str, repetition: int) -> Course:
    """The same whatever follows it."""
    return course(SETTINGS[name], FRAMES, np.random.default_rng([repetition]))


def _error_rows(name: str, samples: int, repetitions: int) -> Iterator[dict[str, object]]:
    for repetition in range(repetitions):
        seen = _course_of(name, repetition)
        off = (seen.observed - seen.truth)[:, [0, 1, 1]]
        yield {"repetition": repetition, "filter": "observation", **_errors(off)}
        for position, kind in enumerate(FILTERS):
            generator = np.random.default_rng([repetition, samples, position])
            found = estimates(kind, SETTINGS[name], samples, seen, generator)
            errors = _errors(found[:, :3] - seen.truth[:, [0, 1, 1]])
            effective = float(found[:, 3].mean())
            yield {"repetition": repetition, "filter": kind, "effective": effective, **errors}


def _errors(off: Array) -> dict[str, float]:
    """Means over frames; `off` is position, colour, and colour by the filter's own estimate."""
    position, colour, own = np.abs(off).mean(axis=0).tolist()
    return {
        "error": float(np.hypot(off[:, 0], off[:, 1]).mean()),
        "position_error": position,
        "colour_error": colour,
        "own_error": float(np.hypot(off[:, 0], off[:, 2]).mean()),
        "own_colour_error": own,
    }


def _association_rows(name: str, repetitions: int) -> Iterator[dict[str, object]]:
    """Whether the best samples of both features are brought together (section 1, MO-6)."""
    for repetition in range(repetitions):
        seen = _course_of(name, repetition)
        for association, kind in _ASSOCIATIONS.items():
            cues = chain(kind, SETTINGS[name], ASSOCIATED, seen.start)
            generator = np.random.default_rng([repetition, ASSOCIATED])
            found = [best_pairs(*cues.step(one, generator)) for one in seen.observed]
            best, top_pairs = np.mean(found, axis=0).tolist()
            pairs = {"best": best, "top_pairs": top_pairs}
            yield {"repetition": repetition, "association": association, **pairs}


def best_pairs(colours: Hypotheses, positions: Hypotheses) -> tuple[float, float]:
    """Weight of the colour of the best position, in mean weights; share of pairs of the best."""
    assert positions.attached is not None
    number = len(colours.weights)
    best = colours.weights[positions.attached[positions.weights.argmax()]] * number
    ranks = colours.weights.argsort().argsort()
    top = positions.weights.argsort()[-round(TOP * len(positions.weights)) :]
    among_best = ranks[positions.attached[top]] >= number - round(TOP * number)
    return float(best), float(among_best.mean())


def factorisation() -> pd.DataFrame:
    """Equation 2 on random discrete models, where all sums can be done: the greatest distances.

    By equation 1 the second measurement depends on the first feature, z₂ = z₂(x₁, z₁). By Bayes'
    rule p(x₁, x₂ | z₁, z₂) = p(x₂ | x₁, z₁, z₂) p(x₁ | z₁, z₂); the proof goes on with p(x₁ | z₁)
    in the place of the latter. Nothing in equation 1 says so: what is measured of x₂ tells of x₁.
    """
    rows = []
    for dependence in DEPENDENCES:
        generator = np.random.default_rng(0)
        models = (joint(generator, informs=dependence == DEPENDENCES[0]) for _ in range(MODELS))
        rows.append({"dependence": dependence, "distance": max(map(distance, models))})
    return pd.DataFrame(rows)


def joint(generator: np.random.Generator, *, informs: bool) -> Array:
    """A random p(x₁, x₂, z₁, z₂) with the dependences of equation 1.

    Parameters
    ----------
    generator : Generator
        Draws all tables.
    informs : bool
        Whether z₂ tells of x₁. Where not, x₂ depends on x₁, and z₂ on both, so that p(z₂ | x₁, z₁)
        is the same for all x₁.

    Returns
    -------
    ndarray of float64, shape (4, 4, 4, 4)
        Sums to 1.
    """
    first = generator.dirichlet(np.ones(STATES))
    measured = generator.dirichlet(np.ones(STATES), STATES)  # z₁ given x₁
    if informs:
        second = generator.dirichlet(np.ones(STATES), (STATES, STATES))  # x₂ given x₁, z₁
        seen = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # z₂ given x₁, x₂, z₁
        both = second[..., np.newaxis] * seen.transpose(0, 2, 1, 3)
    else:
        total = generator.dirichlet(np.ones(STATES), STATES)  # z₂ given z₁
        shares = generator.dirichlet(np.ones(STATES), (STATES,) * 3)  # x₂ given x₁, z₁, z₂
        both = (total[np.newaxis, ..., np.newaxis] * shares).transpose(0, 1, 3, 2)
    # `both` is p(x₂, z₂ | x₁, z₁), axes x₁, z₁, x₂, z₂.
    whole = (first[:, np.newaxis] * measured)[..., np.newaxis, np.newaxis] * both
    return np.ascontiguousarray(whole.transpose(0, 2, 1, 3))


def distance(model: Array) -> float:
    """Greatest total variation, over measurements, of posterior and product of equation 2.

    Parameters
    ----------
    model : ndarray of float64, shape (n, n, n, n)
        p(x₁, x₂, z₁, z₂).
    """
    posterior = model / model.sum(axis=(0, 1))
    of_first = model.sum(axis=(1, 3))
    first = of_first / of_first.sum(axis=0)  # p(x₁ | z₁)
    second = model / model.sum(axis=1, keepdims=True)  # p(x₂ | x₁, z₁, z₂)
    product = first[:, np.newaxis, :, np.newaxis] * second
    return float(0.5 * np.abs(posterior - product).sum(axis=(0, 1)).max())
