"""The rules by which claims are judged: pure functions of a value a cell.

    order(differences, margin)          "A is better than B", differences A - B
    order_of_groups(first, second, generator, margin)    the same of two groups: an interaction
    equal(differences, margin)          "A is comparable to B"
    no_worse(differences, margin)       "A is at least as good as B"
    all_kept(kept_runs, runs)           "tracks the whole sequence", counts a cell
    share_at_least(successes, trials, least, lower)      the same with other limits
    ratio_above(numerator, denominator, least)           times measured side by side
    above(value, interval, least, cells, words)          any other number with an interval
    number(values, published, same_setting)              a published number beside ours

Each returns a `Verdict`; what needs no rule, and how several become one, `outcomes` has.
Differences and margins have the same unit. Fewer than `LEAST_CELLS` cells decide nothing.

One test says "holds" of a claim that is just false, or "does not hold" of one that is just true,
in 2.5 % of cases or somewhat fewer, also of U-shaped and half-lost populations; of skewed ones in
up to 6 % over 8 cells and 4 % over 20 (`hall_interval`). What shows up in one scene of ten can't
be known from eight: in 43 % of cases none of them is such a scene. A claim of many parts is
corrected for their number (`outcomes.conjunction`). A paper's claims together are not: of forty
that are each just true, one is expected to be said not to hold.
"""

from dataclasses import replace
from math import exp, log, nan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.statistics.intervals import (
    Interval,
    difference_interval,
    hall_interval,
    prediction_interval,
    share_interval,
)
from bench.statistics.outcomes import (
    LEAST_CELLS,
    NOWHERE,
    Outcome,
    Verdict,
    chance,
    check,
    conjunction,
    undecided,
)

__all__ = [
    "KEPT_LIMIT",
    "KEPT_SHARE",
    "LEAST_CELLS",
    "LEAST_FOR_NOTHING",
    "MARGIN",
    "NOWHERE",
    "Outcome",
    "Verdict",
    "above",
    "all_kept",
    "check",
    "conjunction",
    "equal",
    "no_worse",
    "number",
    "order",
    "order_of_groups",
    "ratio_above",
    "share_at_least",
    "too_few",
    "undecided",
]

# Set before anything was run, and the same for all papers; a claim may state another margin.
LEAST_FOR_NOTHING = 35
"""Below this many, no difference is said to be too small to matter: where it is large in one scene
of ten, so many scenes show none of these in one case of forty (0.9³⁵), eight in 43 % of cases."""

MARGIN = 0.02
"""Difference that means nothing in practice: a fiftieth of a sequence's length, or of overlap."""

SIGN_SHARE = 0.75
"""Of the cells that must show an order, so that no single scene makes it."""

KEPT_SHARE, KEPT_LIMIT = 0.90, 0.75
"""Of runs that keep the target where a text says "tracks", and the least that chance may leave."""


def order(differences: ArrayLike, margin: float = MARGIN) -> Verdict:
    """Judge "A is better than B".

    Holds where the 95 % interval of the mean difference is above 0 and not wholly inside
    ± margin, and the difference is above 0 in at least three quarters of the cells. Does not
    hold where the interval is below 0 and not wholly inside ± margin; over `LEAST_FOR_NOTHING`
    cells or more, also where it is inside.

    Parameters
    ----------
    differences : array of float, shape (n_cells,)
        A - B, positive where A is better, each averaged over repetitions.
    margin : float
        Differences up to this mean nothing in practice, 0 or more.
    """
    cells = _cells(differences, margin)
    if len(cells) < LEAST_CELLS:
        return _too_few(cells)
    interval, mean = hall_interval(cells), float(cells.mean())
    right = int((cells > 0).sum())
    outcome, words, against = _ordered(mean, interval, margin, len(cells))
    if outcome == "holds" and right < SIGN_SHARE * len(cells):
        outcome = "undecided"
        words = f"the mean is above 0, but only in {right} of {len(cells)} cells is the difference"
    else:
        words += f"; positive in {right} of {len(cells)} cells"
    return Verdict(outcome, mean, interval, len(cells), f"{words}.", against)


def order_of_groups(
    first: ArrayLike, second: ArrayLike, generator: np.random.Generator, margin: float = MARGIN
) -> Verdict:
    """Judge "the mean of the first group is above that of the second" (an interaction).

    As `order`, by a bootstrap-t interval over the cells of both groups; as cells of two groups
    have no pairs, there is no rule about signs. Either group needs `LEAST_CELLS` cells.
    """
    ours, theirs = _cells(first, margin), _cells(second, margin)
    smaller = min(ours, theirs, key=len)
    if len(smaller) < LEAST_CELLS:
        return _too_few(smaller)
    interval = difference_interval(ours, theirs, generator)
    statistic = float(ours.mean() - theirs.mean())
    outcome, words, against = _ordered(statistic, interval, margin, len(smaller))
    words += f"; means {ours.mean():+.3f} and {theirs.mean():+.3f}"
    return Verdict(outcome, statistic, interval, len(ours) + len(theirs), f"{words}.", against)


def equal(differences: ArrayLike, margin: float = MARGIN) -> Verdict:
    """Judge "A is comparable to B".

    Holds where the 95 % interval of the mean difference lies inside ± margin, over
    `LEAST_FOR_NOTHING` cells or more. Does not hold where it lies wholly outside. (Two one-sided
    tests at 5 % would take the 90 % interval: wrong twice as often as all other rules.)
    Parameters: see `order`.
    """
    cells = _cells(differences, margin)
    if len(cells) < LEAST_CELLS:
        return _too_few(cells)
    mean, interval = float(cells.mean()), hall_interval(cells)
    outcome: Outcome = "undecided"
    words = f"the interval reaches over the margin of ±{margin:g}"
    if interval.inside(margin):
        few = len(cells) < LEAST_FOR_NOTHING
        words = f"the interval lies inside ±{margin:g}{_rare_scenes(len(cells)) if few else ''}"
        outcome = "undecided" if few else "holds"
    elif interval.low > margin or interval.high < -margin:
        words = f"the interval lies outside ±{margin:g}"
        outcome = "does-not-hold"
    against = min(
        chance(-mean, -interval.low, -margin, len(cells)),
        chance(mean, interval.high, -margin, len(cells)),
    )
    return Verdict(outcome, mean, interval, len(cells), f"{words}.", against)


def no_worse(differences: ArrayLike, margin: float = MARGIN) -> Verdict:
    """Judge "A is as good as B, or better".

    As `equal`; it also holds where `order` does, or where the interval is wholly above the
    margin. Parameters: see `order`.
    """
    as_good, better = equal(differences, margin), order(differences, margin)
    if as_good.verdict == "does-not-hold" and as_good.statistic > 0:
        as_good = replace(as_good, verdict="holds", reason="it is better by more than the margin.")
    found = better if better.verdict == "holds" else as_good
    against = chance(found.statistic, found.interval.high, -margin, max(found.cells, 2))
    return replace(found, against=against if found.cells >= LEAST_CELLS else nan)


def all_kept(kept_runs: ArrayLike, runs: ArrayLike) -> Verdict:
    """Judge "tracks the whole sequence": see `share_at_least`, with .90 and .75."""
    return share_at_least(kept_runs, runs, KEPT_SHARE, KEPT_LIMIT)


def share_at_least(
    successes: ArrayLike, trials: ArrayLike, least: float, lower: float | None = None
) -> Verdict:
    """Judge whether a share is high enough.

    Holds where the share of all trials is at least `least` and the lower limit of its interval
    is above `lower`; does not hold where the upper limit is below `lower`. Runs in one scene fare
    alike: see `share_interval`.

    Parameters
    ----------
    successes, trials : array of int, shape (n_cells,)
        Counts a cell; trials of 1 or more.
    least, lower : float
        Shares in [0, 1]; `lower` is `least` where it is not given.
    """
    good, runs = _cells(successes, 0.0), _cells(trials, 0.0)
    if good.shape != runs.shape or (runs < 1).any() or (good < 0).any() or (good > runs).any():
        raise ValueError("there must be 0 to all successes in each cell, and a trial or more.")
    if not len(runs):
        return _too_few(runs)
    share = float(good.sum() / runs.sum())
    interval = share_interval(good, runs)
    if len(runs) < LEAST_CELLS:
        return Verdict("undecided", share, interval, len(runs), too_few(len(runs)))
    lower = least if lower is None else lower
    whole = int((good == runs).sum())
    words = f"{good.sum():.0f} of {runs.sum():.0f}, all of them in {whole} of {len(runs)} cells"
    outcome: Outcome = "undecided"
    if share >= least and interval.low > lower:
        outcome = "holds"
    elif interval.high < lower:
        outcome = "does-not-hold"
    against = chance(share, interval.high, lower, len(runs))
    return Verdict(outcome, share, interval, len(runs), f"{words}.", against)


def ratio_above(numerator: ArrayLike, denominator: ArrayLike, least: float) -> Verdict:
    """Judge whether something takes longer by more than a factor.

    Holds where the 95 % interval of the geometric mean of the ratios is above `least`, does not
    hold where it is below.

    Parameters
    ----------
    numerator, denominator : array of float, shape (n_pairs,)
        Times in seconds, above 0; those of a pair were measured right after one another.
    least : float
        Ratio that must be exceeded.
    """
    over, under = _cells(numerator, 0.0), _cells(denominator, 0.0)
    if over.shape != under.shape or (over <= 0).any() or (under <= 0).any():
        raise ValueError("a ratio needs as many times above as below, and all of them above 0.")
    ratios = np.log(over / under)
    if len(ratios) < LEAST_CELLS:
        return _too_few(np.exp(ratios))
    mean, ends = float(ratios.mean()), hall_interval(ratios)
    found = above(mean, ends, log(least), len(ratios), "")
    interval = Interval(exp(ends.low), exp(ends.high))
    words = (
        f"{exp(mean):.3f} times as long (95 %: {interval.low:.3f} to {interval.high:.3f}), to be "
        f"compared with {least:g}."
    )
    unit = "times as long"
    return replace(found, statistic=exp(mean), interval=interval, reason=words, unit=unit)


def above(value: float, interval: Interval, least: float, cells: int, words: str) -> Verdict:
    """Judge whether a number lies above a limit.

    Holds where its 95 % interval is above, does not hold where it is below.

    Parameters
    ----------
    value, interval, least : float, Interval and float
        The number, its interval and the limit; all with their signs turned for "lies below".
    cells : int
        What it rests on.
    words : str
        The reason, a sentence.
    """
    outcome: Outcome = "undecided"
    if interval.low > least:
        outcome = "holds"
    elif interval.high < least:
        outcome = "does-not-hold"
    against = chance(value, interval.high, least, max(cells, 2))
    return Verdict(outcome, value, interval, cells, words, against)


def number(
    values: ArrayLike,
    published: float | None = None,
    same_setting: bool = False,
    *,
    most: float | None = None,
) -> Verdict:
    """Set a published number beside ours.

    Only on the paper's own data or setting can it be `reproduced`: where it falls inside the
    95 % prediction interval of one run. Elsewhere nothing is tested.

    Parameters
    ----------
    values : array of float, shape (n_runs,)
        Ours, one a run, two or more.
    published : float or None
        The paper's.
    same_setting : bool
        Whether ours come from the paper's own data or setting.
    most : float, optional
        The greatest that values can be where they can't lie below 0, either: 1 for shares, or how
        many there are to count. Then their interval lies in between, too.
    """
    runs = _cells(values, 0.0)
    interval = prediction_interval(runs)
    interval = interval if most is None else Interval(*np.clip(interval, 0.0, most).tolist())
    mean = float(runs.mean())
    beside = f"{mean:.3f} (one run: {interval.low:.3f} to {interval.high:.3f})"
    if published is not None:
        beside += f" beside the paper's {published:.3f}"
    if published is None or not same_setting:
        reason = f"{beside}: numbers of other videos, printed and not judged."
        return Verdict("not-testable", mean, interval, len(runs), reason)
    found = interval.low <= published <= interval.high
    outcome: Outcome = "reproduced" if found else "does-not-hold"
    return Verdict(outcome, mean, interval, len(runs), f"{beside}.")


def _ordered(
    mean: float, interval: Interval, margin: float, cells: int
) -> tuple[Outcome, str, float]:
    """Outcome, words, and the p-value against the claim."""
    against = chance(mean, interval.high, 0.0, cells)
    if cells >= LEAST_FOR_NOTHING:
        ends = (
            chance(mean, interval.high, margin, cells),
            chance(-mean, -interval.low, margin, cells),
        )
        against = min(against, max(ends))
    if interval.inside(margin):
        words = f"the difference is within ±{margin:g}"
        if cells < LEAST_FOR_NOTHING:
            return "undecided", words + _rare_scenes(cells), against
        return "does-not-hold", f"{words}, too small to matter", against
    if interval.high < 0:
        return "does-not-hold", "the order is the other way round", against
    if interval.low > 0:
        return "holds", "the order is as claimed", against
    return "undecided", "the interval contains 0", against


def _rare_scenes(cells: int) -> str:
    return f", but {cells} cells may miss rare scenes where it is large: {LEAST_FOR_NOTHING} tell"


def _cells(values: ArrayLike, margin: float) -> NDArray[np.float64]:
    cells = np.asarray(values, np.float64)
    if cells.ndim != 1 or not np.isfinite(cells).all():
        raise ValueError("a verdict needs one finite value a cell.")
    if margin < 0:
        raise ValueError(f"the margin is {margin}; give 0 or more.")
    return cells


def too_few(cells: int) -> str:
    """Why so few cells decide nothing, in a sentence."""
    counted = "1 cell decides" if cells == 1 else f"{cells} cells decide"
    return f"{counted} nothing; {LEAST_CELLS} are needed."


def _too_few(cells: NDArray[np.float64]) -> Verdict:
    reason = too_few(len(cells))
    interval = hall_interval(cells) if len(cells) > 1 else NOWHERE
    mean = float(cells.mean()) if len(cells) else nan
    return Verdict("undecided", mean, interval, len(cells), reason)
