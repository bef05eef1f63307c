"""Answer sentence: what may be called better, ties, limits and long lists."""

from math import nan

import pytest

from trackmark.bench.reporting.answer import Measured, RankedTracker, answer

FEW = Measured(3)
MANY = Measured(8)


def ranked(name, mean, label="", interval=None, wins=0, milliseconds=nan, reason=""):
    return RankedTracker(name, mean, interval, wins, milliseconds, label, reason)


def test_fewer_than_six_sequences_have_no_better_tracker():
    trackers = [
        ranked("static", 0.41, "inconclusive", milliseconds=0.003),
        ranked("camshift", 0.62, "inconclusive", wins=1, milliseconds=0.04),
        ranked("opencv-mil", 0.801, wins=2, milliseconds=24),
    ]
    heading, details = answer(trackers, FEW)
    assert heading == "opencv-mil has the highest mean overlap on these 3 sequences: 0.80."
    assert details == (
        "camshift follows with 0.62 and is hundreds of times faster.",
        "opencv-mil leads on 2 of 3 sequences, camshift on 1.",
        "Three sequences are too few to generalise (6 needed).",
    )
    assert "best" not in answer(trackers, FEW).text
    trackers[2] = trackers[2]._replace(clock="wall time with transfer")
    assert answer(trackers, FEW).details[0] == "camshift follows with 0.62."


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
            "a has the highest mean overlap, 0.80 [0.70, 0.90]; it is not clearly better than 4 of "
            "4 trackers.",
        ),
    ],
)
def test_better_and_worse_follow_from_the_decisions(labels, heading):
    others = [ranked("bcde"[n], 0.6 - 0.1 * n, label) for n, label in enumerate(labels)]
    assert answer([ranked("a", 0.8, interval=(0.7, 0.9)), *others], MANY).heading == heading


def test_chosen_tracker_can_be_worse():
    trackers = [ranked("mine", 0.5, interval=(0.4, 0.6)), ranked("other", 0.8, "worse")]
    text = (
        "mine has a mean overlap of 0.50 [0.40, 0.60] on all 8 sequences; it is worse than other."
    )
    assert answer(trackers, MANY, main="mine") == (text, ())


def test_ties_share_the_answer():
    trackers = [ranked(name, mean) for name, mean in (("a", 0.5), ("b", 0.5), ("c", 0.4))]
    heading, details = answer(trackers, FEW)
    assert heading == "a and b have the highest mean overlap on these 3 sequences: 0.50."
    assert details[0] == "c follows with 0.40."
    near = [ranked("a", 0.804), ranked("b", 0.801)]
    heading, details = answer(near, FEW)
    assert heading.endswith(": 0.804.")
    assert details[0] == "b follows with 0.801."


def test_one_tracker_one_sequence_and_no_score():
    (heading, details) = answer([ranked("a", 0.5)], Measured(1))
    assert heading == "a has a mean overlap of 0.50 on this sequence."
    assert details == ("One sequence is too few to generalise (6 needed).",)
    assert answer([], FEW, left_out=["a"]) == ("There is no answer: all runs failed.", ())


def test_lower_scores_can_be_better():
    measured = Measured(8, title="centre error", suffix=" px", decimals=1, higher=False)
    trackers = [ranked("a", 9.04), ranked("b", 3.11, interval=(2, 4)), ranked("c", 8.0, "better")]
    trackers[0] = ranked("a", 9.04, "inconclusive", (1, 9), reason="interval contains 0")
    heading, details = answer(trackers, measured)
    assert heading == (
        "b has the lowest centre error, 3.1 px [2.0, 4.0]; it is better than c; it is not clearly "
        "better than a."
    )
    assert details == ("c follows with 8.0 px.",)
    second = ranked("b", 0.4, "inconclusive", (0, 1), reason="interval contains 0; 9 needed")
    _, details = answer([ranked("a", 0.5), second], Measured(8))
    assert (
        details[0] == "b follows with 0.40 (the interval of the difference contains 0; 9 needed)."
    )
