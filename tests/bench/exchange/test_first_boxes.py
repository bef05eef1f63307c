"""First boxes and headers of imported results against the ground truth and the request."""

import json

import numpy as np
import pytest

from tests.bench.exchange.import_builder import import_runs, result_sequence
from trackmark.bench.exchange.importing import ImportedTracker, import_results
from trackmark.bench.exchange.result_format import ExchangeError
from trackmark.bench.store.run_store import RunStore

TRUTH = np.array([[50, 46, 25, 62], [52, 45, 25, 61], [55, 44, 25, 60], [57, 44, 26, 60]], float)
ONE_BASED = TRUTH + [1, 1, 0, 0]


def to_corners(boxes):
    return np.column_stack([boxes[:, :2], boxes[:, :2] + boxes[:, 2:]])


def text(boxes):
    return "".join(",".join(f"{value:g}" for value in box) + "\n" for box in boxes)


def import_boxes(folder, boxes, kind="otb", truth=TRUTH, **header):
    """Import a file and return the run and the messages."""
    theirs = folder / "theirs"
    theirs.mkdir()
    if kind == "otb-json":
        record = {"res": np.asarray(boxes).tolist(), "seqName": "Couple", **header}
        (theirs / "Couple.json").write_text(json.dumps([record]))
    else:
        (theirs / "Couple.txt").write_text(text(boxes))
    messages = []
    (run,) = import_runs(kind, theirs, ("Couple", truth), folder / "results", messages.append)
    return run, messages


@pytest.mark.parametrize(
    ("convert", "words"),
    [
        (lambda boxes: to_corners(boxes + [1, 1, 0, 0]), "corners x1, y1.*subtract x1 from x2"),
        (lambda boxes: boxes / [100, 200, 100, 200], "shares of the image size"),
        (lambda boxes: boxes + np.column_stack([boxes[:, 2:] / 2, 0 * boxes[:, 2:]]), "centres"),
        (lambda boxes: boxes[:, [1, 0, 3, 2]], "y, x, height, width"),
    ],
)
def test_import_refuses_other_units(convert, words, tmp_path):
    truth = np.array([[50, 16, 25, 62]] * 4, float)
    sequence = result_sequence("Couple", truth, image_size=(100, 200))
    (tmp_path / "Couple.txt").write_text(text(convert(truth)))
    with pytest.raises(ExchangeError, match=f"Couple.txt: the boxes look like {words}"):
        import_runs("otb", tmp_path, sequence, tmp_path / "results")


SMALL = np.array([[50, 46, 6, 8]] * 4, float)
MOVING = np.array([[50 + 5 * i, 46, 25, 62] for i in range(9)], float)


@pytest.mark.parametrize(
    ("truth", "rows"),
    [
        (SMALL, to_corners(SMALL + [1, 1, 0, 0]) - [0, 0, 1, 1]),
        (MOVING, np.vstack([MOVING[:1], to_corners(MOVING)[1:]])),
        (TRUTH, to_corners(ONE_BASED) * [[1], [1], [0], [1]]),
    ],
    ids=["last pixel included", "after a first box", "zeros in a lost frame"],
)
def test_import_refuses_corners_that_differ_from_the_truth(truth, rows, tmp_path):
    with pytest.raises(ExchangeError, match="the boxes look like corners"):
        import_boxes(tmp_path, rows, truth=truth)


def test_import_reads_boxes_near_the_origin_as_boxes(tmp_path):
    truth = np.array([[1, 2, 20, 30]] * 4, float)
    run, messages = import_boxes(tmp_path, truth + [1, 1, 0, 0], truth=truth)
    np.testing.assert_array_equal(run.boxes, truth)
    assert not messages


@pytest.mark.parametrize(
    "first",
    [
        [51, 47, 25, 62],
        [50, 46, 25, 62],  # from 0
        [52, 47, 24, 61],
        [49, 43, 30, 60],  # of another version of the ground truth
        [55, 50, 25, 62],  # the tracker's first estimate
    ],
)
def test_import_accepts_a_close_first_box(first, tmp_path):
    run, messages = import_boxes(tmp_path, np.vstack([first, ONE_BASED[1:]]))
    np.testing.assert_array_equal(run.boxes[0], TRUTH[0])
    assert not any("overlaps the ground truth" in message for message in messages)


@pytest.mark.parametrize("first", [[200, 150, 25, 62], [0, 0, 0, 0], [51, 47, 9, 20]])
def test_import_reports_a_first_box_that_does_not_fit(first, tmp_path):
    _, (assumed, message) = import_boxes(tmp_path, np.vstack([first, ONE_BASED[1:]]))
    assert "Assumed: from 1, as in the files of the data set." in assumed
    assert "Couple.txt: the first box (" in message
    assert "overlaps the ground truth (50, 46, 25, 62) by 0." in message
    assert "Check that the file is for this sequence" in message


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ({"seqName": "Crossing"}, "seqName is 'Crossing'. Expected: 'Couple'"),
        ({"startFrame": 5, "endFrame": 8}, "startFrame is 5. Expected: 1"),
        ({"startFrame": 1, "endFrame": 9}, "endFrame 9 for 4 rows. Expected: endFrame 4"),
        ({"endFrame": 9}, "startFrame is 6. Expected: 1"),
        ({"startFrame": True}, "startFrame is 'True'. Expected: a whole number"),
        ({"startFrame": float("nan")}, "startFrame is 'nan'. Expected: a whole number"),
    ],
)
def test_otb_json_header_of_other_frames_is_refused(header, words, tmp_path):
    with pytest.raises(ExchangeError, match=r"Couple.json: ") as error:
        import_boxes(tmp_path, ONE_BASED, "otb-json", **header)
    assert words in str(error.value)


@pytest.mark.parametrize(
    "header", [{"seqName": "couple"}, {"seqName": None}, {"startFrame": 0, "endFrame": 3}]
)
def test_otb_json_header_of_the_same_frames_is_accepted(header, tmp_path):
    run, messages = import_boxes(tmp_path, ONE_BASED, "otb-json", **header)
    np.testing.assert_array_equal(run.boxes, TRUTH)
    assert not messages


def test_otb_json_header_counts_image_files_of_otb(tmp_path):
    (tmp_path / "theirs").mkdir()
    record = {"res": ONE_BASED.tolist(), "seqName": "David", "startFrame": 300, "endFrame": 303}
    (tmp_path / "theirs" / "David.json").write_text(json.dumps([record]))
    folders = tmp_path / "theirs", ("David", TRUTH), tmp_path / "results"
    assert len(import_runs("otb-json", *folders, pytest.fail)) == 1


def import_files(folder, files, first_pixel=1, name="data-{}"):
    """Import text files of one tracker by number of the sequence; return the boxes and messages."""
    theirs, messages = folder / "theirs", []
    theirs.mkdir()
    for number, boxes in enumerate(files):
        (theirs / f"{name.format(number)}.txt").write_text(text(boxes))
    sequences = [
        result_sequence(name.format(number), TRUTH, first_pixel=first_pixel)
        for number in range(len(files))
    ]
    trackers = [ImportedTracker("theirs", "otb", theirs)]
    import_results(trackers, sequences, folder / "results", messages.append)
    results = RunStore(folder / "results")
    return [results.read(key).boxes for key in sorted(results.list_keys())], messages


def test_origin_is_decided_for_all_files_of_a_tracker(tmp_path):
    """Check that a first box one pixel off, as rounded by a tracker, does not shift its file."""
    off = np.vstack([TRUTH[:1], ONE_BASED[1:]])
    runs, (message,) = import_files(tmp_path, [ONE_BASED, off, ONE_BASED])
    np.testing.assert_array_equal(runs, [TRUTH] * 3)
    assert "data-1.txt: the first box shows pixels from 0 (1 of 3 files)" in message


def test_majority_of_files_wins_against_the_data_set(tmp_path):
    runs, messages = import_files(tmp_path, [TRUTH, ONE_BASED, TRUTH])
    np.testing.assert_array_equal(runs[::2], [TRUTH] * 2)
    assert "pixels are counted from 0, as the first boxes of 2 of 3 files show" in messages[0]


@pytest.mark.parametrize("first_pixel", [0, 1])
def test_data_set_decides_if_first_boxes_do_not(first_pixel, tmp_path):
    boxes = TRUTH + [first_pixel, first_pixel, 0, 0]
    first = boxes[:1] + [[0.5, 0.5, -1, -1]]  # the tracker's own estimate
    runs, (message,) = import_files(tmp_path, [np.vstack([first, boxes[1:]])] * 2, first_pixel)
    np.testing.assert_array_equal(runs, [TRUTH] * 2)
    assert f"Assumed: from {first_pixel}, as in the files of the data set" in message


def test_origin_needs_the_size_of_the_init_box(tmp_path):
    """Check a tracker that stores its first estimate, which misses the position by one pixel."""
    first = TRUTH[:1] - [[0, 0, 0, 0.5]]
    (run,), _ = import_files(tmp_path, [np.vstack([first, ONE_BASED[1:]])])
    np.testing.assert_array_equal(run, TRUTH)
