"""Answer sentence: what may be called better, ties, limits and long lists."""

from dataclasses import replace
from math import nan

import numpy as np
import pytest

from trackmark.bench.analysis.comparison import Comparison, Pair, Standing
from trackmark.bench.analysis.decisions import answer_of
from trackmark.bench.analysis.run_tables import SUMMARY
from trackmark.bench.statistics.rules import Decision
from trackmark.bench.statistics.units import units_of

OVERLAP = SUMMARY[0]
ERROR = next(measure for measure in SUMMARY if measure.name == "centre_error")


def standing(name, mean, interval=None, milliseconds=nan, clock=""):
    return Standing(name, mean, interval, False, nan, milliseconds, 1e3 / milliseconds, clock)


def answer(main, standings, n=8, decisions=None, wins=None, measure=OVERLAP):
    """Return the answer on n sequences.

    `decisions`: label and reason of the main tracker against others, by name. `wins`: number of
    sequences on which a tracker leads, by name.
    """
    sequences = [f"s{number}" for number in range(n)]
    names = [entry.tracker for entry in standings]
    zeros = np.zeros(n)
    pairs = [
        Pair(main, name, zeros, zeros, Decision(label, nan, reason=reason), None, 0, 0)
        for name, (label, reason) in (decisions or {}).items()
    ]
    scores = {name: [np.array([0.5])] * n for name in names}
    leaders = [name for name, count in (wins or {}).items() for _ in range(count)]
    for number, leader in enumerate(leaders):
        scores[leader] = [*scores[leader]]
        scores[leader][number] = np.array([0.9])
    comparison = Comparison(
        measure=measure,
        units=units_of(sequences),
        sequences=sequences,
        scores=scores,
        standings=standings,
        pairs=pairs,
        main=main,
        against=False,
        failures={},
        left_out=[],
        not_repeatable=[],
        attributes=[],
    )
    return answer_of(comparison)


def test_fewer_than_six_sequences_have_no_better_tracker():
    standings = [
        standing("static", 0.41, milliseconds=0.003),
        standing("camshift", 0.62, milliseconds=0.04),
        standing("opencv-mil", 0.801, milliseconds=24),
    ]
    wins = {"camshift": 1, "opencv-mil": 2}
    heading, details = answer("opencv-mil", standings, 3, wins=wins)
    assert heading == "opencv-mil has the highest mean overlap on these 3 sequences: 0.80."
    assert details == (
        "camshift follows with 0.62 and is about 600 times faster.",
        "opencv-mil leads on 2 of 3 sequences, camshift on 1.",
        "Three sequences are too few to generalise (6 needed).",
    )
    standings[2] = replace(standings[2], clock="wall time with transfer")
    assert answer("opencv-mil", standings, 3).details[0] == "camshift follows with 0.62."


@pytest.mark.parametrize(
    ("labels", "heading"),
    [
        (["better"], "a is better than b: mean overlap 0.80 [0.70, 0.90]."),
        (["better"] * 3, "a is better than b, c and d: mean overlap 0.80 [0.70, 0.90]."),
        (["better"] * 4, "a is better than the other 4 trackers: mean overlap 0.80 [0.70, 0.90]."),
        (
            ["inconclusive", "equivalent", "better"],
            "a has the highest mean overlap, 0.80 [0.70, 0.90]; it is better than d; it is not "
            "clearly better than b; it is equivalent to c.",
        ),
        (
            ["inconclusive"] * 4,
            "a has the highest mean overlap, 0.80 [0.70, 0.90]; it is not clearly better than "
            "the other 4 trackers.",
        ),
    ],
)
def test_better_and_worse_follow_from_the_decisions(labels, heading):
    decisions = {"bcde"[n]: (label, "") for n, label in enumerate(labels)}
    others = [standing(name, 0.6 - 0.1 * n) for n, name in enumerate(decisions)]
    standings = [standing("a", 0.8, (0.7, 0.9)), *others]
    assert answer("a", standings, decisions=decisions).heading == heading


def test_chosen_tracker_can_be_worse():
    standings = [standing("mine", 0.5, (0.4, 0.6)), standing("other", 0.8)]
    text = (
        "mine has a mean overlap of 0.50 [0.40, 0.60] on all 8 sequences; it is worse than other; "
        "other has the highest, 0.80."
    )
    assert answer("mine", standings, decisions={"other": ("worse", "")}) == (text, ())


@pytest.mark.parametrize("n", [1, 5])
def test_chosen_tracker_on_few_sequences_names_the_best(n):
    standings = [standing("mine", 0.67), standing("b", 0.74), standing("c", 0.74)]
    heading, _ = answer("mine", standings, n)
    where = "this sequence" if n == 1 else "these 5 sequences"
    assert heading == f"mine has a mean overlap of 0.67 on {where}; b and c have the highest, 0.74."
    standings = [standing("mine", 9.0), standing("b", 3.1)]
    heading, _ = answer("mine", standings, n, measure=replace(ERROR, decimals=2))
    assert heading.endswith("; b has the lowest, 3.1 px.")


def test_ties_share_the_answer():
    standings = [standing(name, mean) for name, mean in (("a", 0.5), ("b", 0.5), ("c", 0.4))]
    heading, details = answer("a", standings, 3)
    assert heading == "a and b have the highest mean overlap on these 3 sequences: 0.50."
    assert details[0] == "c follows with 0.40."
    heading, details = answer("a", [standing("a", 0.804), standing("b", 0.801)], 3)
    assert heading.endswith(": 0.804.")
    assert details[0] == "b follows with 0.801."


def test_one_tracker_on_one_sequence():
    heading, details = answer("a", [standing("a", 0.5)], 1)
    assert heading == "a has a mean overlap of 0.50 on this sequence."
    assert details == ("One sequence is too few to generalise (6 needed).",)


def test_many_leading_trackers_are_counted():
    standings = [standing(name, 0.5 - 0.1 * n) for n, name in enumerate("abcde")]
    _, details = answer("a", standings, wins={"e": 1, "b": 2, "a": 3, "c": 1, "d": 1})
    assert "a leads on 3 of 8 sequences, b on 2, c on 1, other trackers on 2." in details


def test_lower_scores_can_be_better():
    measure = replace(ERROR, decimals=2)
    standings = [standing("a", 9.04, (1, 9)), standing("b", 3.11, (2, 4)), standing("c", 8.0)]
    decisions = {"a": ("inconclusive", "interval contains 0"), "c": ("better", "")}
    heading, details = answer("b", standings, decisions=decisions, measure=measure)
    assert heading == (
        "b has the lowest centre error, 3.1 px [2.0, 4.0]; it is better than c; it is not clearly "
        "better than a."
    )
    assert details == ("c follows with 8.0 px.",)


def test_reason_of_the_second_tracker_is_printed():
    reason = "interval contains 0; 9 needed"
    standings = [standing("a", 0.5), standing("b", 0.4, (0, 1))]
    _, details = answer("a", standings, decisions={"b": ("inconclusive", reason)})
    assert (
        details[0] == "b follows with 0.40 (the interval of the difference contains 0; 9 needed)."
    )
