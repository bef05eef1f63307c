"""Table of docs/comparing.md that compares the decision rule with other methods."""

import re
from math import ceil
from pathlib import Path

import numpy as np
import pytest

from tests.bench.statistics import published_scores
from tests.bench.statistics.published_scores import FILE, METHODS, PAIRS, SIZES, rates, read_scores
from trackmark.bench.statistics.rules import MIN_UNITS, decide

PAGE = Path(__file__).parents[3] / "docs" / "comparing.md"


@pytest.fixture(scope="module")
def population():
    if not FILE.is_file():
        pytest.skip(f"{FILE} is absent: published scores of OTB")
    return read_scores()


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_table_of_methods_is_that_of_the_page(method, population):
    (line,) = (line for line in PAGE.read_text().splitlines() if line.startswith(f"| {method} |"))
    documented = [[*map(float, cell.split("/"))] for cell in line.strip("| ").split("|")[1:]]
    computed = [rates(population, METHODS[method], n)[:3] for n in SIZES]
    assert documented == [pytest.approx(row, abs=0.55) for row in computed]


@pytest.mark.slow
def test_tests_of_ranks_accuse_trackers_of_equal_means(population):
    text = re.sub(r"\s+", " ", PAGE.read_text())
    for name, words in (
        ("Nemenyi", "Nemenyi's test accuses one in {:.0f} % of experiments with 60"),
        ("Wilcoxon, Holm", "Wilcoxon's test does so in {:.0f} %"),
        ("rule of trackmark", "and the rule in {:.0f} %"),
    ):
        assert words.format(rates(population, METHODS[name], 60)[3]) in text


@pytest.mark.slow
def test_advised_numbers_decide_as_often_as_the_page_states(population):
    """New samples of both ends of the range, for pairs that are inconclusive on n sequences."""
    random, shares = np.random.default_rng(5), []
    for n in (8, 12, 20, 40):
        no_estimate, decided = 0, []
        for _ in range(4000):
            first, second = random.choice(len(population), 2, replace=False)
            values = population[first] - population[second]
            decision = decide(random.choice(values, n))
            if not decision.reason.startswith("interval contains 0"):
                continue
            if decision.needed is None:
                no_estimate += 1
                continue
            sizes = [max(MIN_UNITS, ceil(end)) for end in decision.needed]
            labels = [decide(random.choice(values, size)).label for size in sizes]
            decided.append([label != "inconclusive" for label in labels])
        share = no_estimate / (no_estimate + len(decided))
        shares.append([share, *np.mean(decided, axis=0)])
    unknown, lower, upper = 100 * np.transpose(shares)
    assert unknown == pytest.approx([52, 52, 49, 48], abs=3)
    assert lower == pytest.approx([31, 33, 38, 41], abs=4)
    assert upper == pytest.approx([74, 75, 78, 81], abs=4)


def test_rule_on_many_experiments_agrees_with_decide():
    scores = np.random.default_rng(1).beta(2, 2, (20, published_scores.TRACKERS, 12))
    signs = {"better": 1, "worse": -1}
    for drawn, answers in zip(scores, METHODS["rule of trackmark"](scores), strict=True):
        labels = [decide(drawn[i] - drawn[j], comparisons=len(PAIRS)).label for i, j in PAIRS]
        assert answers.tolist() == [signs.get(label, 0) for label in labels]
