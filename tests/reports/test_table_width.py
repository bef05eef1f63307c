"""Tables on a terminal: no wider than it, with what a reader needs first."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.reporting.tables import PER_SEQUENCE, SUMMARY, TIMES
from trackmark.reports.printable import MAX_WIDTH
from trackmark.reports.renderers import to_markdown, to_text
from trackmark.reports.table_width import on_terminal
from trackmark.reports.tables import sequence_table, summary_table

TRACKERS = ("static", "camshift:window=adaptive", "opencv-mil")


def scored(measures, failed=()):
    """Runs with three repetitions each, on two sequences of 120 frames."""
    rng = np.random.default_rng(0)
    runs = pd.DataFrame(
        [
            (t, s, r)
            for t in TRACKERS
            for s in ("samples/bow-tie", "samples/face")
            for r in range(3)
        ],
        columns=["tracker", "sequence", "repetition"],
    )
    for measure in measures:
        runs[measure.name] = rng.uniform(60, 119, len(runs)) / measure.scale
    runs["evaluated_frames"], runs["frames"] = 119.0, 120
    runs["status"] = ["failed" if tracker in failed else "finished" for tracker in runs["tracker"]]
    runs["failure"] = "frame 3: no idea"
    runs.loc[runs["status"] == "failed", [measure.name for measure in measures]] = np.nan
    return runs


@pytest.mark.parametrize(
    ("table", "measures"),
    [(summary_table, SUMMARY), (sequence_table, PER_SEQUENCE), (sequence_table, TIMES)],
)
@pytest.mark.parametrize("failed", [(), ("static", "opencv-mil")])
def test_a_table_is_no_wider_than_a_terminal_and_says_what_is_left_out(table, measures, failed):
    made = table(scored(measures, failed), measures, "A title of some length", "native")
    said = on_terminal(made, to_text, " (--wide)")
    assert max(map(len, said.splitlines())) <= MAX_WIDTH
    assert max(map(len, to_text(made).splitlines())) > MAX_WIDTH
    _, _, left_out = said.replace("\n", " ").partition("Left out: ")
    heads = said.split("\n\n")[1].partition("\n---")[0].split()
    for measure in measures:
        assert (measure.head in left_out) or not {*measure.head.split()} - {*heads}
    assert left_out.strip().endswith("(--wide).") == bool(left_out)
    assert said.count("3 of 3 failed") + said.count("6 of 6 failed") == len(failed) * (
        2 if table is sequence_table else 1
    )
    for name in TRACKERS:
        assert name in said
    assert made.heads == [*made.heads[: made.n_labels], *(one.head for one in measures)]


def test_a_table_that_fits_is_left_as_it_is():
    made = sequence_table(scored(PER_SEQUENCE[:2]), PER_SEQUENCE[:2], "T", "native")
    assert on_terminal(made, to_text) == to_text(made)


@pytest.mark.parametrize("columns", [72, 80, 200])
def test_a_table_fits_the_terminal_that_there_is(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    made = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "A title " * 30, "native")
    widest = max(map(len, on_terminal(made, to_text).splitlines()))
    assert min(columns, MAX_WIDTH) - 20 < widest <= min(columns, MAX_WIDTH)


def test_a_label_of_a_group_takes_no_room_from_columns_and_heads_take_several_lines():
    made = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "T", "native")
    long = "plain/target:length=60:noise=30:occlusion=0.5:scene=4"
    rows = [[replace(row[0], text=long), *row[1:]] for row in made.rows]
    lines = on_terminal(replace(made, rows=rows), to_text).splitlines()
    assert long in lines
    assert next(line for line in lines if "static" in line)[32:].split()
    assert "  first loss" in lines[2]
    assert "[frame]" in lines[3]


def test_labels_that_no_rows_share_stay_in_theirs():
    made = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "T", "native")
    rows = [[replace(row[0], text="ABCDEF"[n]), *row[1:]] for n, row in enumerate(made.rows)]
    said = on_terminal(replace(made, rows=rows), to_text)
    beside = {line[0]: line.split()[1] for line in said.splitlines() if line[:2] in ("A ", "D ")}
    assert set(beside.values()) <= {*TRACKERS}
    assert len(beside) == 2


def test_a_long_note_is_wrapped():
    made = sequence_table(scored(PER_SEQUENCE[:2]), PER_SEQUENCE[:2], "T", "native")
    note = "not scored: " + "a reason that is told at some length, " * 5 + "with a \x1b in it"
    said = on_terminal(replace(made, notes=[note]), to_text)
    assert max(map(len, said.splitlines())) <= MAX_WIDTH
    assert note.replace("\x1b", "\\u001b") in said.replace("\n", " ")


def test_what_was_never_lost_has_no_first_loss():
    runs = scored(PER_SEQUENCE)
    runs.loc[runs["tracker"] == "static", "first_loss"] = 120
    runs.loc[runs["tracker"] == "opencv-mil", "first_loss"] = [7, 7, 7, 7, 7, 120]
    made = sequence_table(runs, PER_SEQUENCE, "T", "native")
    column = made.heads.index("first loss [frame]")
    by_cell = {(row[0].text, row[1].text): row[column].text for row in made.rows}
    assert by_cell["samples/face", "static"] == "none"
    assert by_cell["samples/bow-tie", "opencv-mil"] == "7 ±0"
    assert by_cell["samples/face", "opencv-mil"].startswith("44.7 ±"), "one of three never was"
    assert "none" in to_markdown(made)
