"""Results and data as people have them: names, rows and origins of real toolkits."""

import csv

import cv2
import numpy as np
import pytest

from tests.bench.commands.conftest import json_lines

pytestmark = pytest.mark.usefixtures("blank_figures")

TRUTH = np.array([[10 + i, 12, 20, 16] for i in range(8)], float)  # pixels from 0
FROM_ONE = TRUTH + [1, 1, 0, 0]


def write_rows(path, rows, separator=","):
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [separator.join(f"{value:g}" for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")


def write_images(folder, n=8, name="{:04}.jpg", first=1):
    folder.mkdir(parents=True)
    for number in range(first, first + n):
        cv2.imwrite(str(folder / name.format(number)), np.full((96, 160, 3), 128, np.uint8))


def write_otb(folder, rows=FROM_ONE):
    write_images(folder / "img")
    write_rows(folder / "groundtruth_rect.txt", rows)


def write_trackingnet(folder):
    write_images(folder / "frames" / "v_0", name="{}.jpg", first=0)
    write_rows(folder / "anno" / "v_0.txt", TRUTH)


@pytest.fixture
def import_results(trackmark, workspace):
    """Return a function that imports results and returns the scores of a preset, and messages."""

    def call(theirs, sequences, preset="otb", score="mean_overlap"):
        paths = f"gt={theirs}", "--sequences", sequences, "--name", "imported"
        done = trackmark("results", "import", *paths)
        trackmark(
            *("report", "results/imported", "--metrics", preset, "--output", "report"),
            "--no-pictures",
        )
        with (workspace / f"report/metrics-{preset}.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["measure"] == score]
        return {row["sequence"]: float(row["mean"]) for row in rows}, done.stderr

    return call


def test_trackingnet_scores_count_from_0(workspace, import_results):
    write_trackingnet(workspace / "TEST")
    boxes = TRUTH.copy()
    boxes[4:] = [120, 70, 20, 16]
    write_rows(workspace / "theirs/v_0.txt", boxes)
    scores, _ = import_results("theirs", "TEST", "trackingnet", "success_auc")
    assert scores["v_0"] == pytest.approx(0.5125)


def test_export_counts_pixels_as_each_data_set(workspace, trackmark):
    write_trackingnet(workspace / "TEST")
    write_otb(workspace / "Board")
    both = ("--sequences", "TEST/frames/v_0,Board")
    trackmark("run", "--trackers", "static", *both, "--name", "ours")
    done = trackmark("results", "export", "results/ours", "theirs", "--as", "otb")
    assert "pixels are counted from 0 and 1." in done.stderr
    first = {
        name: (workspace / f"theirs/static/{name}.txt").read_text().partition("\n")[0]
        for name in ("v_0", "Board")
    }
    assert first == {
        "v_0": "10.0000,12.0000,20.0000,16.0000",
        "Board": "11.0000,13.0000,20.0000,16.0000",
    }
    trackmark("results", "import", "static=theirs/static", *both, "--name", "again")
    rows = json_lines(trackmark("results", "list", "results", "--json"))
    by_experiment = {
        name: [row["scores"] for row in rows if row["experiment"] == name]
        for name in ("ours", "again")
    }
    assert by_experiment["ours"] == by_experiment["again"]


def test_import_knows_prefixes_of_pytracking(workspace, import_results):
    write_otb(workspace / "sets" / "bird1_1")
    write_rows(workspace / "theirs/uav_bird1_1.txt", FROM_ONE, "\t")
    overlaps, messages = import_results("theirs", "sets")
    assert overlaps["bird1_1"] == 1
    assert "uav_bird1_1 is read as the results on bird1_1." in messages


def write_lasot(folder, rows=FROM_ONE):
    write_images(folder / "img", name="{:08}.jpg")
    write_rows(folder / "groundtruth.txt", rows)
    for flag in ("full_occlusion", "out_of_view"):
        (folder / f"{flag}.txt").write_text(",".join("0" * len(rows)))


def test_malformed_rows_of_lasot_are_counted_and_scored(workspace, trackmark, import_results):
    rows = FROM_ONE.copy()
    rows[4] = [61, 73, 24, -1]
    write_lasot(workspace / "tiger/tiger-6", rows)
    write_rows(workspace / "theirs/tiger-6.txt", FROM_ONE)
    scores, messages = import_results("theirs", "tiger/tiger-6", "lasot", "precision")
    assert scores["tiger-6"] == 1.0  # the toolkit's distance in this frame is -1
    remark = "1 row of the ground truth without a positive size (first for 00000005.jpg)"
    assert f"tiger-6: {remark}" in messages
    assert remark in trackmark("run", "--trackers", "static", "--sequences", "tiger").stderr
    scores, _ = import_results("theirs", "tiger/tiger-6", "lasot", "success_auc")
    assert scores["tiger-6"] == pytest.approx(7 / 8 * 20 / 21)


def write_got10k(folder, cover):
    write_images(folder, name="{:08}.jpg")
    write_rows(folder / "groundtruth.txt", FROM_ONE)
    (folder / "cover.label").write_text("".join(f"{level}\n" for level in cover))


def test_got10k_without_visible_frames_has_no_scores(workspace, trackmark):
    write_got10k(workspace / "val/a", [8] * 8)
    write_got10k(workspace / "val/b", [8] + [0] * 7)
    for name in "ab":
        write_rows(workspace / f"theirs/{name}/{name}_001.txt", FROM_ONE)
    report = ("report", "--results-of", "gt=theirs", "--metrics", "got10k")
    alone = trackmark(*report, "--sequences", "val/b").stdout
    assert "—: no frame after the first shows the target" in alone
    assert "cover.label): b" in " ".join(alone.split())
    assert "0.000" not in alone
    both = trackmark(*report, "--sequences", "val").stdout
    assert "all sequences" in both
    assert "1.000" in both
