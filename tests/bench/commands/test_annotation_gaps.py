"""Data sets as users have them: sparse annotation, test sets, several targets, unread files."""

import csv
import json

import cv2
import numpy as np
import pytest

from tests.bench.commands.conftest import json_lines, unwrapped
from trackmark import datasets

SIZE = (96, 160)
BOXES = "".join(f"{11 + i},13,20,16\n" for i in range(8))

pytestmark = pytest.mark.usefixtures("blank_figures")


def write_images(folder, n, name="{:04}.png", first=1):
    folder.mkdir(parents=True)
    for i in range(n):
        assert cv2.imwrite(str(folder / name.format(first + i)), np.full((*SIZE, 3), 128, np.uint8))
    return folder


def described(trackmark, path):
    return json.loads(trackmark("describe", path, "--json").stdout)


def mean_scores(folder, preset):
    with (folder / f"metrics-{preset}.csv").open() as file:
        return {row["measure"]: float(row["mean"] or "nan") for row in csv.DictReader(file)}


def test_sparse_truth_scores_annotated_frames_only(trackmark, workspace):
    write_images(workspace / "sparse", 40)
    rows = [f"{i},{10 + i},12,20,16\n" for i in (0, 10, 20, 30, 39)]
    (workspace / "sparse/truth.csv").write_text("frame,x,y,width,height\n" + "".join(rows))
    (workspace / "boxes").mkdir()
    boxes = [f"{10 + i},12,20,16\n" if i % 10 in (0, 9) else "90,60,5,5\n" for i in range(40)]
    (workspace / "boxes/sparse.txt").write_text("".join(boxes))
    assert "35 of 40 frames are not annotated" in described(trackmark, "sparse")["remarks"]
    presets = "otb,lasot,trackingnet,got10k,long-term"
    trackmark("results", "import", "perfect=boxes", "--sequences", "sparse", "--name", "runs")
    trackmark("report", "results/runs", "--metrics", presets, "--output", "out", "--no-pictures")
    assert mean_scores(workspace / "out", "otb")["success_auc"] == pytest.approx(20 / 21)
    assert mean_scores(workspace / "out", "lasot")["precision"] == 1.0
    assert mean_scores(workspace / "out", "trackingnet")["precision_auc"] == 1.0
    assert mean_scores(workspace / "out", "got10k")["ao"] == 1.0
    assert mean_scores(workspace / "out", "long-term")["recall"] == pytest.approx(0.8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ["run", "--trackers", "static"],
        ["compare", "static", "camshift"],
        ["baseline", "mine", "--trackers", "static"],
    ],
)
def test_commands_that_run_name_frames_without_annotation(command, trackmark, workspace):
    write_images(workspace / "sparse", 4)
    (workspace / "sparse/truth.csv").write_text(
        "frame,x,y,width,height\n0,10,12,20,16\n3,13,12,20,16\n"
    )
    printed = unwrapped(trackmark(*command, "--sequences", "sparse").stderr)
    assert printed.count("sparse: 2 of 4 frames are not annotated and not scored.") == 1


def test_empty_box_states_absence_in_scores(trackmark, workspace):
    write_images(workspace / "gone", 4)
    rows = "0,10,12,20,16\n1,,,,\n3,10,12,20,16\n"
    (workspace / "gone/truth.csv").write_text(f"frame,x,y,width,height\n{rows}")
    (row,) = json_lines(trackmark("run", "--trackers", "static", "--sequences", "gone", "--json"))
    assert row["scores"]["evaluated_frames"] == 1
    assert row["scores"]["absent_frames"] == 1


def test_annotated_video_is_absent_after_the_last_mark(trackmark, workspace):
    write_images(workspace / "clip", 6)
    trackmark("annotate", "clip", "--box", "1:10,12,20,16", "--box", "3:14,12,20,16")
    sequence = datasets.load(workspace / "clip")
    assert sequence.annotated.all()
    assert sequence.present.tolist() == [False, True, True, True, False, False]


def test_folder_runs_all_targets_of_its_sequences(trackmark, workspace):
    write_images(workspace / "davis/JPEGImages/480p/v", 3, "{:05}.png", 0)
    masks = workspace / "davis/Annotations/480p/v"
    masks.mkdir(parents=True)
    for i in range(3):
        mask = np.zeros(SIZE, np.uint8)
        mask[10:30, 5 + i : 25 + i], mask[40:60, 80:100] = 1, 2
        cv2.imwrite(str(masks / f"{i:05}.png"), mask)
    rows = json_lines(trackmark("run", "--trackers", "static", "--sequences", "davis", "--json"))
    assert {row["sequence"] for row in rows} == {"v", "v:object=2"}
    warning = "v: 1 other target is not used, for example v:object=2."
    run = ("run", "--trackers", "static", "--name", "one", "--sequences")
    assert warning in unwrapped(trackmark(*run, "davis/JPEGImages/480p/v").stderr)
    for several in ("davis", "davis/JPEGImages/480p/v:object=1"):
        assert "not used" not in trackmark(*run, several).stderr


def test_current_folder_can_be_a_sequence_of_two_targets(trackmark, workspace, monkeypatch):
    write_images(workspace / "Jogging/img", 8)
    for target in (1, 2):
        (workspace / f"Jogging/groundtruth_rect.{target}.txt").write_text(BOXES)
    monkeypatch.chdir(workspace / "Jogging")
    rows = json_lines(trackmark("run", "--trackers", "static", "--sequences", ".", "--json"))
    assert {row["sequence"] for row in rows} == {"Jogging.1", "Jogging.2"}


def test_unread_flag_file_is_named(trackmark, workspace):
    write_images(workspace / "a_1/img", 8)
    (workspace / "a_1/groundtruth_rect.txt").write_text(BOXES)
    (workspace / "a_1/absent.txt").write_text("0\n0\n0\n1\n0\n0\n0\n0\n")
    assert "absent.txt is not read" in described(trackmark, "a_1")["remarks"]
    printed = trackmark("run", "--trackers", "static", "--sequences", "a_1").stderr
    assert "a_1: absent.txt is not read" in unwrapped(printed)


def test_test_set_runs_all_images_without_scores(trackmark, workspace):
    write_images(workspace / "v/color", 8, "{:08}.png")
    (workspace / "v/groundtruth.txt").write_text("10,12,20,16\n")
    done = trackmark("run", "--trackers", "static", "--sequences", "v", "--json")
    (row,) = json_lines(done)
    assert (row["frames"], row["scores"]["mean_overlap"]) == (8, None)
    assert "v: 7 of 8 frames are not annotated and not scored." in unwrapped(done.stderr)
    done = trackmark("run", "--trackers", "static", "--sequences", "v", "--metrics", "otb")
    assert "otb cannot score runs on v: no frame after the init" in unwrapped(done.stdout)
    assert "0.952" not in done.stdout


def test_codes_of_vots_are_read(trackmark, workspace):
    write_images(workspace / "v/color", 8, "{:08}.png")
    rows = "m10,12,3,2,0,6\n0\n0\nm11,12,3,2,0,6\n0\n1\n0\n0\n"
    (workspace / "v/groundtruth_1.txt").write_text(rows)
    assert described(trackmark, "v")["truth"] == (
        "target present in 2 of 8 frames, absent in 1, not annotated in 5"
    )
    sequence = datasets.load(workspace / "v")
    assert np.flatnonzero(sequence.annotated).tolist() == [0, 3, 5]
    assert [sequence.mask(i) is not None for i in (0, 1, 3)] == [True, False, True]


def test_unreadable_sequences_are_named_together(trackmark, workspace, otb):
    for name in ("A", "B", "C"):
        otb(workspace / "set" / name, 5)
    (workspace / "set/A/groundtruth_rect.txt").write_text("5,6,10,12\n" * 3)
    (workspace / "set/C/groundtruth_rect.txt").write_text("5,6,0,12\n" * 5)
    done = trackmark("run", "--trackers", "static", "--sequences", "set", status=2)
    text = unwrapped(done.stderr)
    assert "2 of 3 sequences cannot be used" in text
    assert "set/A/groundtruth_rect.txt: 3 rows for 5 images" in text
    assert "set/C/groundtruth_rect.txt: the first box" in text
    assert "trackmark run --trackers static --sequences 'set,!A,!C'" in text
