"""Result files with another number of rows or of numbers per row."""

import numpy as np
import pytest

from tests.bench.exchange.import_builder import import_runs
from trackmark.bench.exchange.importing import parse_imported_tracker
from trackmark.bench.exchange.result_format import ExchangeError

TRUTH = np.array([[10 + i, 12, 20, 16] for i in range(8)], float)
SHIFT = [1, 1, 0, 0]


def import_rows(folder, rows, separator=",", truth=TRUTH):
    theirs, messages = folder / "theirs", []
    theirs.mkdir()
    lines = [separator.join(f"{value:g}" for value in row) for row in rows]
    (theirs / "Board.txt").write_text("\n".join(lines) + "\n")
    kind = parse_imported_tracker(f"theirs={theirs}").format
    target = folder / "results"
    (run,) = import_runs(kind, theirs, ("Board", truth), target, messages.append)
    return run.boxes, messages


@pytest.mark.parametrize(("separator", "treated"), [(",", "not scored"), ("\t", "a miss")])
def test_missing_last_row_is_treated_as_in_toolkits(separator, treated, tmp_path):
    boxes, (message,) = import_rows(tmp_path, TRUTH[:-1] + SHIFT, separator)
    np.testing.assert_array_equal(boxes, [*TRUTH[:-1], [np.nan] * 4])
    assert "Board.txt: 7 rows for the 8 frames of Board: line 8 is missing" in message
    assert message.endswith(f"as in the toolkits, it is {treated}.")


def test_additional_rows_are_cut_with_a_note(tmp_path):
    boxes, (message,) = import_rows(tmp_path, np.vstack([TRUTH, TRUTH[:5]]) + SHIFT)
    np.testing.assert_array_equal(boxes, TRUTH)
    assert "13 rows for the 8 frames of Board: the rows after line 8" in message


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (TRUTH[:-2], "6 rows for the 8 frames of Board: ends after line 6"),
        (TRUTH[1:] + [9, 0, 0, 0], "line 1 is not the box at initialisation"),
        (np.vstack([TRUTH[3:], TRUTH]) + [9, 0, 0, 0], "line 1 is not the box at initialisation"),
    ],
)
def test_rows_of_unknown_frames_are_refused(rows, words, tmp_path):
    with pytest.raises(ExchangeError, match=words):
        import_rows(tmp_path, rows)


@pytest.mark.parametrize("separator", [",", "\t"])
def test_polygons_are_read_as_their_bounding_boxes(separator, tmp_path):
    x, y, width, height = (TRUTH + SHIFT).T
    polygons = np.column_stack([x, y, x + width, y, x + width, y + height, x, y + height])
    boxes, (message,) = import_rows(tmp_path, polygons, separator)
    np.testing.assert_array_equal(boxes, TRUTH)
    assert "eight numbers and are read as the bounding boxes of polygons" in message


@pytest.mark.parametrize(
    "line", ["1,5 2,5 3,5 4,5", "1,5\t2,5\t3,5\t4,5", "1 2,5 3 4", "1,50,2,50,3,00,4,25"]
)
def test_decimal_commas_are_refused(line, tmp_path):
    (tmp_path / "Board.txt").write_text(f"{line}\n" * 8)
    with pytest.raises(ExchangeError, match=r"line 1: .*Expected: .* points as decimal"):
        import_runs("otb", tmp_path, ("Board", TRUTH), tmp_path / "results")


def test_polygons_of_decimal_commas_are_refused(tmp_path):
    folder = tmp_path / "baseline" / "Board"
    folder.mkdir(parents=True)
    for file, format_name in ((tmp_path / "Board.txt", "otb"), (folder / "Board_001.txt", "vot")):
        file.write_text("1\n" * (format_name == "vot") + "10,5,20,2,30,0,40,0\n" * 8)
        with pytest.raises(ExchangeError, match=r"looks like a box with decimal commas"):
            import_runs(format_name, tmp_path, ("Board", TRUTH), tmp_path / "results")
