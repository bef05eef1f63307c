"""Marks of times that other load has disturbed."""

import pandas as pd

from trackmark.bench.analysis.score_tables import sequence_table
from trackmark.bench.analysis.times import DISTURBED, TIME, time_marks, time_notes, with_fps


def test_only_times_of_disturbed_runs_are_marked():
    names = ["tracker", "sequence", "run_delay_share", TIME.name]
    rows = [("a", "x", 0.5, 1.0), ("a", "y", 0.0, 2.0), ("b", "x", 0.0, 3.0), ("b", "y", 0.0, 4.0)]
    runs = pd.DataFrame(rows, columns=names).assign(
        protocol="timing",
        repetition=0,
        status="finished",
        failure="",
        clock="wall",
        machine="m",
        time_note="",
    )
    assert time_marks(runs) == {"a": DISTURBED, "b": ""}
    table = with_fps(sequence_table(runs, [TIME], "", "native"), runs)
    column = table.headings.index(TIME.heading)
    marked = {tuple(cell.text for cell in row[:2]) for row in table.rows if "!" in row[column].text}
    assert marked == {("x", "a")}
    (note,) = [note for note in time_notes(runs) if note.startswith(DISTURBED)]
    assert "up to 50 %" in note
