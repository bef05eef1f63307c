"""Answer sentence: what may be called better, ties, limits and long lists."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from trackmark.bench.analysis.comparison import Comparison, Pair, Standing
from trackmark.bench.analysis.decisions import answer_of, no_winner_reason
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.statistics.rules import Decision
from trackmark.bench.statistics.units import units_of

OVERLAP = SUMMARY[0]
ERROR = next(measure for measure in SUMMARY if measure.name == "centre_error")


def standing(name, mean, interval=None, milliseconds=nan, clock=""):
    return Standing(name, mean, interval, False, nan, milliseconds, 1e3 / milliseconds, clock)


def compared(main, standings, n=8, decisions=None, measure=OVERLAP, **changes):
    """Return a comparison on n sequences.

    `decisions`: label of the main tracker against others, by name. `changes`: further fields of the
    comparison.
    """
    sequences = [f"s{number}" for number in range(n)]
    zeros = np.zeros(n)
    pairs = [
        Pair(main, name, zeros, zeros, Decision(label, nan), None, 0, 0)
        for name, label in (decisions or {}).items()
    ]
    fields = {"against": False, "failures": {}, "left_out": [], "not_repeatable": []}
    return Comparison(
        measure=measure,
        units=units_of(sequences),
        sequences=sequences,
        scores={},
        standings=standings,
        pairs=pairs,
        main=main,
        attributes=[],
        **(fields | changes),
    )


def answer(main, standings, *arguments, **options):
    """Return the answer of `compared`."""
    return answer_of(compared(main, standings, *arguments, **options))


def ranked(*names):
    """Return standings with means of 0.8, 0.7, … and intervals that no answer prints."""
    return [standing(name, 0.8 - 0.1 * n, (0.1, 0.9)) for n, name in enumerate(names)]


LIMIT = "Three sequences are too few to generalise (6 needed)."


def test_fewer_than_six_sequences_have_no_better_tracker():
    standings = [
        standing("static", 0.41),
        standing("camshift", 0.62),
        standing("opencv-mil", 0.801),
    ]
    heading = "Mean overlap on these 3 sequences: opencv-mil 0.80, camshift 0.62, static 0.41."
    assert answer("opencv-mil", standings, 3) == (heading, (LIMIT,))
    names = "Mean overlap on these 3 sequences: a 0.80, b 0.70, {} and 2 more."
    assert answer("a", ranked(*"abcde"), 3).heading == names.format("c 0.60")
    # The tracker that the user has named is always in the answer.
    assert answer("e", ranked(*"abcde"), 3, against=True).heading == names.format("e 0.40")


@pytest.mark.parametrize(
    ("labels", "heading", "second"),
    [
        (["better"], "a is better than b: 0.80 against 0.70.", ""),
        (["better"] * 2, "a is better than b and c: 0.80 against 0.70 and 0.60.", ""),
        (["better"] * 4, "a is better than the other 4 trackers: 0.80 against 0.70 or less.", ""),
        (["equivalent"], "a is equivalent to b: 0.80 against 0.70.", ""),
        (
            ["better", "equivalent"],
            "a is better than b and equivalent to c: 0.80 against 0.70 and 0.60.",
            "",
        ),
        (  # The second-best mean is lower with certainty, so that the first tracker leads.
            ["better", "inconclusive"],
            "a is better than b and not clearly different from c: 0.80 against 0.70 and 0.60.",
            "",
        ),
        (["inconclusive"] * 2, "No clear winner: a 0.80, b 0.70, c 0.60.", ""),
        (
            ["inconclusive", "equivalent", "better"],
            "No clear winner: a 0.80, b 0.70, c 0.60.",
            "; a is better than d",
        ),
        (
            ["inconclusive"] * 4 + ["better"] * 4,
            "No clear winner: a 0.80, b 0.70, c 0.60 and 2 more.",
            "; a is better than 4 of the other 8 trackers",
        ),
    ],
)
def test_answer_follows_from_the_decisions(labels, heading, second):
    decisions = {"bcdefghi"[n]: label for n, label in enumerate(labels)}
    details = (f"Mean overlap on 8 sequences{second}.",)
    assert answer("a", ranked("a", *decisions), decisions=decisions) == (heading, details)


@pytest.mark.parametrize(
    ("labels", "reason"),
    [
        (["inconclusive"] * 2, "a is not clearly different from b and c"),
        (["inconclusive", "equivalent", "better"], "a is not clearly different from b"),
        (
            ["inconclusive"] * 4 + ["better"] * 4,
            "a is not clearly different from 4 of the other 8 trackers",
        ),
        (["better", "inconclusive"], ""),  # the answer names the best tracker
        (["equivalent"], ""),
    ],
)
def test_reason_names_the_trackers_that_are_not_separated(labels, reason):
    decisions = {"bcdefghi"[n]: label for n, label in enumerate(labels)}
    assert no_winner_reason(compared("a", ranked("a", *decisions), 8, decisions)) == reason
    assert no_winner_reason(compared("a", ranked("a", *decisions), 3, decisions)) == ""


def test_name_of_a_tracker_is_no_answer():
    name, decisions = "No clear winner", {"b": "better"}
    assert no_winner_reason(compared(name, ranked(name, "b"), 8, decisions)) == ""


def test_named_tracker_is_compared_with_all_others():
    decisions = {"a": "worse", "c": "better", "d": "inconclusive"}
    heading = (
        "b is better than c, worse than a and not clearly different from d: 0.70 against 0.60, "
        "0.80 and 0.50."
    )
    assert answer("b", ranked(*"abcd"), decisions=decisions, against=True).heading == heading
    heading, details = answer("b", ranked("b"), against=True, left_out=["a"])
    assert heading == "b has a mean overlap of 0.80 on 8 sequences."
    assert details == ("a left out: all runs failed.",)
    # All runs of the named tracker failed, so that there are no pairs.
    heading, _ = answer("x", ranked("a", "b"), against=True, left_out=["x"])
    assert heading == "Mean overlap on 8 sequences: a 0.80, b 0.70."


def test_published_trackers_give_a_rank():
    decisions = {"a": "worse", "c": "better", "d": "inconclusive"}
    heading, details = answer("b", ranked(*"abcd"), decisions=decisions, published=["a", "c", "d"])
    assert heading == "b has rank 2 of 4 by mean overlap on 8 sequences: 0.70."
    assert details == ("It is better than c, worse than a and not clearly different from d.",)
    assert answer("b", ranked(*"abcd"), 3, published=["a", "c", "d"]).details == (LIMIT,)


def test_close_means_have_a_further_digit():
    standings = [standing(name, mean) for name, mean in (("a", 0.804), ("b", 0.801), ("c", 0.4))]
    assert answer("a", standings, 3).heading.endswith(": a 0.804, b 0.801, c 0.400.")
    standings[1] = replace(standings[1], mean=0.804)
    assert answer("a", standings, 3).heading.endswith(": a 0.80, b 0.80, c 0.40.")


def test_one_tracker_on_one_sequence():
    heading, details = answer("a", [standing("a", 0.5)], 1)
    assert heading == "a has a mean overlap of 0.50 on this sequence."
    assert details == ("One sequence is too few to generalise (6 needed).",)


def test_lower_scores_can_be_better():
    measure = replace(ERROR, decimals=2)
    standings = [standing("a", 9.04, (1, 9)), standing("b", 3.11, (2, 4)), standing("c", 8.0)]
    decisions = {"a": "better", "c": "inconclusive"}
    heading, details = answer("b", standings, decisions=decisions, measure=measure)
    assert heading == "No clear winner: b 3.1 px, c 8.0 px."
    assert details == ("Centre error on 8 sequences; b is better than a.",)
    decisions = dict.fromkeys("acde", "better")
    standings += [standing("d", 10), standing("e", 11)]
    heading, _ = answer("b", standings, decisions=decisions, measure=measure)
    assert heading == "b is better than the other 4 trackers: 3.1 px against 8.0 px or more."
