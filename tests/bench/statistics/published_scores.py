"""Comparison of methods for intervals on published scores: 34 trackers on 100 sequences of OTB.

Each experiment draws four trackers and n sequences, with replacement, and compares all six pairs.
The means over the 100 sequences are the truth. For false answers the trackers are equal: on every
sequence their scores are permuted. `python -m tests.bench.statistics.published_scores` prints the
table of docs/comparing.md.
"""

import sys
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import bootstrap, rankdata, ttest_1samp
from scipy.stats import studentized_range as studentised

from trackmark.bench.statistics.intervals import interval_ends
from trackmark.bench.statistics.rules import MARGIN, corrected_level

FILE = Path(__file__).parents[3].parent / "shared" / "published" / "otb100-per-sequence.csv"
SIZES = (6, 8, 12, 20, 30, 60)
EXPERIMENTS, TRACKERS, RESAMPLES = 1000, 4, 2000
LARGE = 0.05
"""True difference from which an answer counts as found."""

PAIRS = np.array([*combinations(range(TRACKERS), 2)])


def read_scores(file=FILE):
    """Return mean overlaps, shape (trackers, sequences)."""
    return pd.read_csv(file).pivot_table("mean_overlap", "tracker", "sequence").to_numpy()


def differences(scores):
    """Return differences of pairs, shape (experiments, pairs, n), of scores of trackers."""
    return scores[:, PAIRS[:, 0]] - scores[:, PAIRS[:, 1]]


def by_rule(scores):
    """Return 1 for better, -1 for worse and 0 for neither, shape (experiments, pairs)."""
    values = differences(scores)
    low, high = interval_ends(values, corrected_level(len(PAIRS)))
    outside = ~((low >= -MARGIN) & (high <= MARGIN))
    return ((low > 0).astype(int) - (high < 0)) * outside


def with_holm(p_values, values):
    """Return the signs of the means whose p-values are significant after Holm's correction."""
    order = p_values.argsort(axis=1)
    limits = 0.05 / np.arange(len(PAIRS), 0, -1)
    passed = np.cumprod(np.take_along_axis(p_values, order, axis=1) <= limits, axis=1)
    significant = np.zeros_like(passed)
    np.put_along_axis(significant, order, passed, axis=1)
    return significant * np.sign(values.mean(axis=-1)).astype(int)


def by_t(scores):
    """Student's t test with Holm's correction."""
    values = differences(scores)
    return with_holm(np.nan_to_num(ttest_1samp(values, 0, axis=-1).pvalue, nan=1), values)


def by_wilcoxon(scores):
    """Wilcoxon's signed-rank test with Holm's correction."""
    values = differences(scores)
    n = values.shape[-1]
    ranks = rankdata(np.abs(values), axis=-1)
    positive = (ranks * (np.sign(values) + 1) / 2).sum(axis=-1)  # a difference of 0 counts half
    law = np.ones(1)  # of the sum of positive ranks, if all signs are equally likely
    for rank in range(1, n + 1):
        law = (np.pad(law, (0, rank)) + np.pad(law, (rank, 0))) / 2
    smaller = np.minimum(positive, n * (n + 1) / 2 - positive).astype(int)
    return with_holm(np.minimum(1, 2 * law.cumsum()[smaller]), values)


def by_bootstrap(scores):
    """BCa bootstrap interval of the mean with Bonferroni's correction."""
    values = differences(scores)
    interval = bootstrap(
        (values,),
        np.mean,
        axis=-1,
        n_resamples=RESAMPLES,
        batch=50,
        confidence_level=corrected_level(len(PAIRS)),
        method="BCa",
        rng=np.random.default_rng(3),
    ).confidence_interval
    return (interval.low > 0).astype(int) - (interval.high < 0)


def by_nemenyi(scores):
    """Nemenyi's test of mean ranks."""
    n = scores.shape[-1]
    ranks = rankdata(scores, axis=1).mean(axis=-1)
    gaps = ranks[:, PAIRS[:, 0]] - ranks[:, PAIRS[:, 1]]
    quantile = studentised.ppf(0.95, TRACKERS, np.inf) / np.sqrt(2)
    limit = quantile * np.sqrt(TRACKERS * (TRACKERS + 1) / (6 * n))
    return np.sign(gaps).astype(int) * (np.abs(gaps) > limit)


METHODS: dict[str, Callable] = {
    "rule of trackmark": by_rule,
    "t test, Holm": by_t,
    "Wilcoxon, Holm": by_wilcoxon,
    "BCa bootstrap": by_bootstrap,
    "Nemenyi": by_nemenyi,
}


def rates(population, method, n, seed=1):
    """Return percentages: false answers, differences found, answers of the wrong direction.

    False answers and wrong directions count experiments with any; differences found are shares of
    the pairs whose true difference is above `LARGE`. The last percentage is that of false answers
    if only the true means are equal: each tracker is shifted.
    """
    random = np.random.default_rng(seed + n)
    trackers = np.argsort(random.random((EXPERIMENTS, len(population))), axis=1)[:, :TRACKERS]
    sequences = random.integers(0, population.shape[1], (EXPERIMENTS, 1, n))
    means = population.mean(axis=1)
    true = means[trackers[:, PAIRS[:, 0]]] - means[trackers[:, PAIRS[:, 1]]]
    drawn = population[trackers[..., None], sequences]
    answers = method(drawn)
    false = method(random.permuted(drawn, axis=1)) != 0
    shifted = method(drawn - means[trackers][..., None]) != 0
    right = answers == np.sign(true)
    wrong = answers == -np.sign(true)
    return (
        100 * false.any(axis=1).mean(),
        100 * right[np.abs(true) > LARGE].mean(),
        100 * wrong.any(axis=1).mean(),
        100 * shifted.any(axis=1).mean(),
    )


def rows(population):
    """Return a row of text for each method: `0.8 / 3 / 0.0` for each number of sequences."""
    for name, method in METHODS.items():
        cells = (rates(population, method, n) for n in SIZES)
        yield [name, *("{:.1f} / {:.0f} / {:.1f}".format(*cell) for cell in cells)]


def main():
    """Print the table as Markdown."""
    lines = [["method", *(f"n = {n}" for n in SIZES)], ["---"] * (1 + len(SIZES))]
    lines += rows(read_scores())
    sys.stdout.writelines(f"| {' | '.join(line)} |\n" for line in lines)


if __name__ == "__main__":
    main()
