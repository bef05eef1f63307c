"""Section 3: a point that changes position and colour in one dimension each.

Both are cues of the tracker's own framework (`trackers.contours.chain`), so that example and
tracker share what makes features dependent. What the paper calls dependent attaches to every
position a colour drawn by the weights of the colour filter; independent, one drawn evenly from all
of the space of colours. A third way, not in the paper, tells two effects apart: `unweighted`
attaches colours of the filter whatever their weights. Of the parameters the paper gives one: λ = 1.

    measure(folder, jobs, effort) -> dict[str, DataFrame], kept until the source changes

- `one-dimensional-errors`: a row a set of parameters (`set`), `samples`, `repetition` and `filter`
  (`observation`, `independent`, `dependent`, `unweighted`): `error` (the distance to the truth in
  the plane of position and colour), `position_error`, `colour_error` (with the colours attached to
  positions, by the positions' weights), `own_error`, `own_colour_error` (with the colour filter's
  own estimate instead), `effective` (effective sample size of the positions, as a share), all of
  them means over frames. Truth and observations of a repetition are the same for all filters and
  numbers.
- `one-dimensional-differences`: paired, over repetitions, a row a set, number, `pair` (as
  `independent less dependent`) and `quantity` (`error`, `position_error`, …): `mean`,
  `standard_error`, limits of the 95 % interval (`lower_limit`, `upper`) and its `degrees`
  of freedom.
- `one-dimensional-trends`: a row a set and filter: `rank_correlation` (of mean error and number),
  and the limits of the interval of error(10) less error(500).
- `one-dimensional-association`: a row a set, repetition and `association` (`by-weight`,
  `uniform`): `best` (weight of the colour that the best position has, in units of the mean weight),
  `top_pairs` (share of the best tenth of the positions whose colour is among the best tenth), means
  over frames.

All have `scale` (λ of the weights) where they have `set`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import trackers
from bench.papers import Effort
from bench.papers.scenes import kept_tables
from bench.statistics.intervals import mean_interval
from datasets.source_digest import source_digest
from trackers.contours.chain import Chain, Hypotheses, ParticleCue, Weighed

__all__ = ["COLOURS", "FILTERS", "FRAMES", "NUMBERS", "POSITIONS", "SETTINGS", "Course", "Filter"]
__all__ += ["Setting", "best_pairs", "chain", "course", "differences", "estimates", "measure"]
__all__ += ["trends"]

Array: TypeAlias = NDArray[np.float64]
Attached: TypeAlias = NDArray[np.intp] | None
Earlier: TypeAlias = Sequence[Hypotheses]
Filter: TypeAlias = Literal["independent", "dependent", "unweighted"]

FILTERS: tuple[Filter, ...] = ("independent", "dependent", "unweighted")

FRAMES = 100
NUMBERS = (5, 10, 20, *range(50, 501, 50))
"""Numbers of samples: the ticks of Fig. 2, and fewer."""

POSITION, COLOUR = 0, 1  # in pairs: of a state, of what is observed, of deviations

DECAY = 0.95  # σ_pos and σ_col: what is left of a deviation from the middle, a frame
POSITIONS, COLOURS = (-1.0, 1.0), (0.0, 1.0)
_MIDDLES = np.array([0.0, 0.5])
_STARTS = np.array([[-0.5, 0.25], [0.5, 0.75]])  # least and most


@dataclass(frozen=True)
class Setting:
    """A set of parameters; pairs are of position and colour.

    λ, the `scale` over which a weight falls to 1/e, and deviations: the `noise` of the truth's
    steps, what is `observed` from the truth, and the `dynamics`, the filters' random walk.
    """

    scale: float
    noise: tuple[float, float]
    observed: tuple[float, float]
    dynamics: tuple[float, float]


SETTINGS: Mapping[str, Setting] = {
    **{
        name: Setting(1.0, (0.1, 0.05), (observed, observed), (0.1, 0.05))
        for name, observed in (("A", 0.1), ("B", 0.3), ("C", 0.5))
    },
    "G": Setting(0.2, (0.05, 0.05), (0.2, 0.2), (0.05, 0.05)),
}
"""Sets by name: the printed weights with accurate, middling and poor observations; a tuned one."""

PACKAGE = Path(str(trackers.__file__)).parent
TITLE = "Section 3, one dimension"

REPETITIONS, ASSOCIATIONS = 80, 20
MORE_REPETITIONS = 200
QUICK_REPETITIONS, QUICK_ASSOCIATIONS, QUICK_NUMBERS = 10, 4, (10, 50, 500)

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

_KEYS = ["set", "scale", "samples"]


class Course(NamedTuple):
    """What happens to the point, position and colour: before the first frame, then (frames, 2)."""

    start: Array
    truth: Array
    observed: Array


def course(setting: Setting, frames: int, generator: np.random.Generator) -> Course:
    """Draw a course: both features go back to the middle and are thrown out again, in bounds."""
    start = generator.uniform(*_STARTS)
    truth = np.empty((frames, 2))
    state = start
    for frame, steps in enumerate(generator.normal(0.0, setting.noise, (frames, 2))):
        # (x - μ) σ + N(μ_noise, σ_noise) with μ_noise = μ
        state = (state - _MIDDLES) * DECAY + _MIDDLES + steps
        state = np.clip(state, *np.transpose([POSITIONS, COLOURS]))
        truth[frame] = state
    return Course(start, truth, truth + generator.normal(0.0, setting.observed, (frames, 2)))


class Feature(ParticleCue):
    """A random walk of position or colour, weighed by exp(-d / λ).

    d is the distance to what is observed of it (PF1), and of what has a colour attached, that of
    this colour besides (PF2). An observation is a pair of position and colour.
    """

    def __init__(self, which: int, start: Array, samples: int, setting: Setting) -> None:
        super().__init__(np.array(start[which]), samples)
        self._which, self._scale = which, setting.scale
        self._spread = setting.dynamics[which]

    def propagated(self, states: Array, generator: np.random.Generator) -> Array:
        """See `ParticleCue.propagated`."""
        return states + self._spread * generator.standard_normal(len(states))

    def weigh(
        self, observation: Array, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        far = np.abs(states - observation[self._which])
        if attached is not None:
            far = np.abs(earlier[-1].states[attached] - observation[COLOUR]) + far
        return Weighed(np.exp(-far / self._scale))


class AnyColour:
    """No knowledge of the colour: all are equally likely, before the frame and after it."""

    def __init__(self, samples: int) -> None:
        self._samples = samples

    def sample(self, generator: np.random.Generator) -> Array:
        """See `Cue.sample`."""
        low, high = COLOURS
        return low + (high - low) * generator.random(self._samples)

    def weigh(
        self, observation: Array, states: Array, attached: Attached, earlier: Earlier
    ) -> Weighed:
        """See `Cue.weigh`."""
        return Weighed(np.ones(len(states)))

    def receive(self, states: Array, weights: Array) -> None:
        """See `Cue.receive`: nothing is learnt."""


def chain(kind: Filter, setting: Setting, samples: int, start: Array) -> Chain[Array]:
    """Cues at the beginning of a course, which is known.

    The colour filter is the first and position the last. Between them, where they are independent,
    stands what gives positions any colour.
    """
    colour, position = (Feature(one, start, samples, setting) for one in (COLOUR, POSITION))
    if kind == "independent":
        return Chain([colour, AnyColour(samples), position])
    return Chain([colour, position], "by-weight" if kind == "dependent" else "uniform")


def estimates(
    kind: Filter, setting: Setting, samples: int, seen: Course, generator: np.random.Generator
) -> Array:
    """Follow a course: rows (frames, 4).

    Σ π₂ s₂, Σ π₂ s₁ of the colours attached, Σ π₁ s₁ of the colour filter, and the effective sample
    size of the positions as a share of their number.
    """
    cues = chain(kind, setting, samples, seen.start)
    rows = []
    for observation in seen.observed:
        found = cues.step(observation, generator)
        first, before, last = found[0], found[-2], found[-1]
        rows.append(
            (
                last.weights @ last.states,
                last.weights @ before.states[last.attached],
                first.weights @ first.states,
                1 / (samples * (last.weights @ last.weights)),
            )
        )
    return np.array(rows)


class _Part(NamedTuple):
    """What one process measures at a time; -1 stands for the association."""

    setting: str
    samples: int


def measure(folder: Path, jobs: int, effort: Effort) -> dict[str, pd.DataFrame]:
    """Simulate, or look up what was simulated before, which `folder` keeps in `one-dimensional/`.

    By so many worker processes; of fewer numbers and repetitions for a quick look, and of more
    repetitions where everything is asked for.
    """
    digest = source_digest(Path(__file__), PACKAGE)
    repetitions = MORE_REPETITIONS if effort.everything else REPETITIONS
    associations, numbers = ASSOCIATIONS, NUMBERS
    if effort.quick:
        repetitions, associations = QUICK_REPETITIONS, QUICK_ASSOCIATIONS
        numbers = QUICK_NUMBERS
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
    }
    return {f"one-dimensional-{name}": table for name, table in found.items()}


def differences(errors: pd.DataFrame) -> pd.DataFrame:
    """Paired differences of errors: `one-dimensional-differences`."""
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
    """How errors go on with the number of samples: `one-dimensional-trends`."""
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
        "degrees": len(values) - 1,
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
