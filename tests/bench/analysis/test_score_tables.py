"""Tables of scores against values computed by hand."""

import io

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.analysis.score_tables import mean_table, sequence_table, with_not_run
from trackmark.reports.renderers import to_csv
from trackmark.reports.tables import ScoreMeasure

OVERLAP = ScoreMeasure("overlap", "overlap", direction="higher", decimals=3)
ERROR = ScoreMeasure("error", "error", "px", "lower", 1)
COUNT = ScoreMeasure("count", "success", "frames", "higher", 1, out_of="total")


def runs(*rows):
    columns = ["tracker", "sequence", "repetition", "status", "overlap", "error"]
    table = pd.DataFrame(rows, columns=columns)
    table["failure"] = np.where(table["status"] == "failed", "frame 3: ValueError: why\ntrace", "")
    table["count"] = table["overlap"] * 100
    table["total"] = 100.0
    return table


def done(tracker, sequence, repetition, overlap, error=1.0):
    return (tracker, sequence, repetition, "finished", overlap, error)


def texts(table):
    return [[cell.text for cell in row] for row in table.rows]


def summary(rows, measures=(OVERLAP,)):
    return mean_table(runs(*rows), measures, "T", "native")


def sequences(rows, measures=(OVERLAP,)):
    return sequence_table(runs(*rows), measures, "T", "native")


def test_summary_weights_sequences_equally():
    table = summary([done("a", "s", 0, 0.2), done("a", "s", 1, 0.4), done("a", "t", 0, 0.9)])
    assert texts(table) == [["a", "0.600"]]  # (0.3 + 0.9) / 2, not (0.2 + 0.4 + 0.9) / 3


def test_spread_is_standard_deviation_over_repetitions():
    rows = [done("a", "s", 0, 0.2), done("a", "s", 1, 0.4)]
    more = [done("a", "t", 0, 0.6), done("a", "t", 1, 0.5)]
    spread = np.std([0.4, 0.45], ddof=1)
    assert texts(summary(rows + more)) == [["a", f"0.425 ±{spread:.3f}"]]
    assert texts(sequences(rows)) == [["s", "a", f"0.300 ±{np.std([0.2, 0.4], ddof=1):.3f}"]]


@pytest.mark.parametrize("status", ["missing", "stale"])
def test_missing_and_stale_runs_make_mean_missing(status):
    table = sequences([done("a", "s", 0, 0.2), ("a", "s", 1, status, 0.9, 0.0)])
    assert texts(table) == [["s", "a", f"— (1 of 2 {status})"]]
    assert table.notes[0].startswith(f"{status}: a, 1 ")


def test_failed_runs_count_if_they_have_a_score():
    failed = ("a", "s", 1, "failed", np.nan, np.nan)
    table = summary([done("a", "s", 0, 0.2), failed, done("b", "s", 0, 0.5)])
    assert texts(table) == [["a", "— (1 of 2 failed)"], ["b", "0.500"]]
    assert table.notes == ["a: 1 of 2 runs failed: sequence s, ValueError: why"]
    table = sequences([done("a", "s", 0, 0.2), (*failed[:4], 0.0, 9.0)])
    assert table.rows[0][2].text.startswith("0.100")
    note = "a: 1 of 2 runs failed (counted as the worst score): sequence s, ValueError: why"
    assert table.notes == [note]


def test_tracker_without_sequence_has_no_mean_and_no_row():
    rows = [done("a", "s", 0, 0.2), done("a", "t", 0, 0.2), done("b", "s", 0, 0.9)]
    table = summary(rows)
    assert texts(table) == [["a", "0.200"], ["b", "— (1 of 2 not run)"]]
    assert table.notes == ["not run: b, 1 of the sequences"]
    assert texts(sequences(rows[1:])) == [["t", "a", "0.200"], ["s", "b", "0.900"]]


def test_malformed_boxes_are_counted_by_tracker():
    frame = runs(done("a", "s", 0, 0.5), done("a", "s", 1, 0.5), done("b", "s", 0, 0.5))
    frame["malformed_boxes"] = [2.0, 1.0, 0.0]
    (note,) = mean_table(frame, (OVERLAP,), "T", "native").notes
    assert note == "malformed: a, 3 boxes not finite with a positive size: misses"


def test_missing_score_makes_mean_missing():
    assert texts(summary([done("a", "s", 0, np.nan), done("a", "s", 1, 0.5)])) == [["a", "—"]]


def test_pairs_without_a_run_are_added():
    full = runs(done("a", "s", 0, 0.1), done("b", "s", 0, 0.1))
    assert with_not_run(full) is full
    added = with_not_run(runs(done("a", "s", 0, 0.1), done("b", "t", 0, 0.1)))
    absent = added.loc[added["status"] == "not run", ["tracker", "sequence"]].to_numpy().tolist()
    assert absent == [["a", "t"], ["b", "s"]]


def test_cells_show_totals_of_counts_and_scaled_values():
    assert texts(sequences([done("a", "s", 0, 0.5)], [COUNT])) == [["s", "a", "50 of 100"]]
    percent = ScoreMeasure("overlap", "o", "%", "higher", 1, scale=100)
    table = summary([done("a", "s", 0, 0.25)], [percent])
    assert texts(table) == [["a", "25.0"]]
    assert table.records["mean"].tolist() == [0.25]


def test_csv_has_unrounded_values_preset_and_totals():
    table = sequences([done("a,b", "s", 0, 0.1 + 0.2)], [OVERLAP, COUNT])
    back = pd.read_csv(io.StringIO(to_csv(table)))
    assert back["mean"].tolist() == [0.1 + 0.2, (0.1 + 0.2) * 100]
    assert back["tracker"].tolist() == ["a,b"] * 2
    assert back["metrics"].tolist() == ["native"] * 2
    np.testing.assert_array_equal(back["out_of"], [np.nan, 100])
