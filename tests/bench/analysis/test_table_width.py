"""Tables on a terminal: they fit its width."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from trackmark.bench.analysis.run_tables import PER_SEQUENCE, SUMMARY, TIMES
from trackmark.bench.analysis.score_tables import mean_table, sequence_table
from trackmark.reports.printable import MAX_WIDTH
from trackmark.reports.renderers import terminal_lines, to_markdown, to_text

TRACKERS = ("static", "camshift:window=adaptive", "opencv-mil")


def on_terminal(table, more=""):
    return "\n".join(terminal_lines(table, more))


def scored(measures, failed=()):
    """Return runs with three repetitions each on two sequences of 120 frames."""
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
    ("table", "measures", "failed"),
    [
        (mean_table, SUMMARY, ("static", "opencv-mil")),
        (sequence_table, PER_SEQUENCE, ("static", "opencv-mil")),
        (sequence_table, TIMES, ()),
    ],
)
def test_wide_table_omits_columns_and_names_them(table, measures, failed):
    wide = table(scored(measures, failed), measures, "A title of some length", "native")
    narrow = on_terminal(wide, "--verbose")
    assert max(map(len, narrow.splitlines())) <= MAX_WIDTH
    assert max(map(len, to_text(wide).splitlines())) > MAX_WIDTH
    _, _, left_out = narrow.replace("\n", " ").partition("Left out: ")
    headings = narrow.partition(TRACKERS[0])[0].split()[len(wide.caption.split()) :]
    for measure in measures:
        assert (measure.heading in left_out) or not {*measure.heading.split()} - {*headings}
    assert left_out.strip().endswith("(--verbose).") == bool(left_out)
    assert narrow.count("3 of 3 failed") + narrow.count("6 of 6 failed") == len(failed) * (
        2 if table is sequence_table else 1
    )
    assert all(name in narrow for name in TRACKERS)


def test_requested_columns_continue_below():
    wide = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "T", "native")
    narrow = "\n".join(terminal_lines(wide, "--verbose", all_columns=True))
    assert max(map(len, narrow.splitlines())) <= MAX_WIDTH
    assert "Left out" not in narrow
    assert all(cell.text in narrow for row in wide.rows for cell in row)
    assert narrow.count("  static ") > narrow.count("samples/face") > 1


@pytest.mark.parametrize("columns", [72, 200])
def test_table_uses_width_of_terminal(monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    wide = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "A title " * 30, "native")
    widest = max(map(len, on_terminal(wide).splitlines()))
    assert min(columns, MAX_WIDTH) - 20 < widest <= min(columns, MAX_WIDTH)


def test_group_labels_and_headings_take_separate_lines():
    wide = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "T", "native")
    long = "plain/target:length=60:noise=30:occlusion=0.5:scene=4"
    rows = [[replace(row[0], text=long), *row[1:]] for row in wide.rows]
    lines = on_terminal(replace(wide, rows=rows)).splitlines()
    assert long in lines
    assert next(line for line in lines if "static" in line)[32:].split()
    assert lines[2].endswith("  centre error")
    assert lines[3].endswith("[px]")


def test_unshared_labels_stay_in_their_rows():
    wide = sequence_table(scored(PER_SEQUENCE), PER_SEQUENCE, "T", "native")
    rows = [[replace(row[0], text="ABCDEF"[n]), *row[1:]] for n, row in enumerate(wide.rows)]
    narrow = on_terminal(replace(wide, rows=rows))
    beside = {line[0]: line.split()[1] for line in narrow.splitlines() if line[:2] in ("A ", "D ")}
    assert set(beside.values()) <= {*TRACKERS}
    assert len(beside) == 2


def test_long_note_is_wrapped():
    wide = sequence_table(scored(PER_SEQUENCE[:2]), PER_SEQUENCE[:2], "T", "native")
    note = "not scored: " + "a reason that is told at some length, " * 5 + "with a \x1b in it"
    narrow = on_terminal(replace(wide, notes=[note]))
    assert max(map(len, narrow.splitlines())) <= MAX_WIDTH
    assert note.replace("\x1b", "\\u001b") in narrow.replace("\n", " ")


def test_run_without_failure_has_no_first_loss():
    runs = scored(PER_SEQUENCE)
    runs.loc[runs["tracker"] == "static", "first_loss"] = 120
    runs.loc[runs["tracker"] == "opencv-mil", "first_loss"] = [7, 7, 7, 7, 7, 120]
    wide = sequence_table(runs, PER_SEQUENCE, "T", "native")
    column = wide.headings.index("first loss [frame]")
    by_cell = {(row[0].text, row[1].text): row[column].text for row in wide.rows}
    assert by_cell["samples/face", "static"] == "none"
    assert by_cell["samples/bow-tie", "opencv-mil"] == "7 ±0"
    assert by_cell["samples/face", "opencv-mil"].startswith("44.7 ±"), "one of three never was"
    assert "none" in to_markdown(wide)
