"""Copies of benchmarks as users have them: one path gives a table."""

import csv
import json
import shutil

import cv2
import numpy as np
import pytest

N = 15
CORNERS = np.array([[20, 20], [25, 15], [30, 20], [25, 25]])
PIXELS_OF_CORNERS = 61  # in the square that stands on a corner, with its edges
RUNS = [0, *[1, 9] * 9, 10]  # an L of 19 pixels in a box of 10 times 10
BOX = "21.0000,16.0000,10.0000,10.0000"


def write_sequence(folder, digits, images=".", **files):
    """Write noise images with file names of `digits` digits, and text files of lines."""
    (folder / images).mkdir(parents=True, exist_ok=True)
    for i in range(N):
        image = np.random.default_rng(i).integers(0, 256, (40, 50, 3), dtype=np.uint8)
        assert cv2.imwrite(str(folder / images / f"{i + 1:0{digits}}.jpg"), image)
    for name, lines in files.items():
        (folder / name.replace("__", ".")).write_text("".join(f"{line}\n" for line in lines))


@pytest.fixture
def vot2016(workspace):
    """Write sequences with images next to the ground truth, and polygons."""
    for name, shift in (("bolt", 0), ("racing", 3)):
        polygon = ",".join(map(str, (CORNERS + shift).ravel().tolist()))
        labels = {"groundtruth__txt": [polygon] * N, "occlusion__label": [0, 1] + [0] * 9}
        write_sequence(workspace / "vot2016" / name, 8, **labels)
    (workspace / "vot2016" / "list.txt").write_text("bolt\nracing\n")
    return workspace / "vot2016"


@pytest.fixture
def vot2020(workspace):
    """Write a sequence with images in their own folder, and masks."""
    mask = ",".join(map(str, ["m20", 15, 10, 10, *RUNS]))
    settings = ["channels.color=color/%08d.jpg", "format=default", "name=agility"]
    files = {"groundtruth__txt": [mask] * N, "anchor__value": [1] + [0] * (N - 1)}
    folder = workspace / "workspace" / "sequences"
    write_sequence(folder / "agility", 8, "color", sequence=settings, **files)
    (folder / "list.txt").write_text("agility\n")
    return folder


@pytest.fixture
def got10k(workspace):
    """Write two sequences of the validation set; the second target is absent for two frames."""
    folder = workspace / "GOT-10k" / "val"
    for number, absent in ((1, ()), (2, (5, 6))):
        write_sequence(
            folder / f"GOT-10k_Val_{number:06}",
            8,
            groundtruth__txt=[BOX] * N,
            absence__label=[int(i in absent) for i in range(N)],
            cover__label=[0 if i in absent else 8 for i in range(N)],
            cut_by_image__label=[0] * N,
            meta_info__ini=["[METAINFO]", "anno_fps: 10Hz", "resolution: (50, 40)"],
        )
    (folder / "list.txt").write_text("GOT-10k_Val_000001\nGOT-10k_Val_000002\n")
    return folder


@pytest.fixture
def otb100(workspace):
    """Write a sequence with one target, and one with two."""
    folder = workspace / "OTB100"
    write_sequence(folder / "Walking", 4, "img", groundtruth_rect__txt=["21\t16\t10\t10"] * N)
    boxes = {f"groundtruth_rect__{k}__txt": [f"{10 * k},16,10,10"] * N for k in (1, 2)}
    write_sequence(folder / "Jogging", 4, "img", **boxes)
    return folder


@pytest.fixture
def scores(trackmark, workspace):
    """Run a tracker on a path; return the printed text and the scores of all sequences.

    Scores come from the report, after the sequences were removed.
    """

    def run(path, metrics, preset, remove=None):
        where = ("--name", "copy", "--sequences", path, "--metrics", metrics)
        done = trackmark("run", "--trackers", "static", *where)
        text = done.stdout + done.stderr
        if remove is not None:
            shutil.rmtree(remove)
        report = ("report", "results/copy", "--metrics", metrics, "--output", "report")
        trackmark(*report, "--no-pictures")
        with (workspace / "report" / f"metrics-{preset}.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["mean"]]
        overall = [row for row in rows if row["sequence"] == "all sequences"] or rows
        return text, {row["measure"]: float(row["mean"]) for row in overall}

    return run


def test_polygons_of_vot_are_scored_from_stored_ground_truth(scores, vot2016):
    text, by_measure = scores("vot2016", "native,vot", "vot-supervised", vot2016)
    assert "bolt" in text
    assert "racing" in text
    assert "read as a folder with groundtruth.txt and images or color/ (VOT)." in text
    # The box excludes its right and bottom sides; the polygon has one pixel on each of them.
    both = PIXELS_OF_CORNERS - 2
    assert by_measure["accuracy"] == pytest.approx(both / (100 + PIXELS_OF_CORNERS - both))
    assert by_measure["failures"] == 0


def test_masks_of_vot_are_scored_from_stored_ground_truth(scores, vot2020):
    text, by_measure = scores(vot2020, "vot-anchor", "vot-anchor", vot2020)
    assert "agility" in text
    assert by_measure["accuracy"] == pytest.approx((N - 1) / N * 19 / 100)
    assert by_measure["robustness"] == 1


def test_copy_of_got10k_is_a_table_by_one_path(trackmark, scores, got10k):
    text, by_measure = scores("GOT-10k", "native,got10k", "got10k")
    assert "GOT-10k_Val_000002" in text
    assert by_measure == {"ao": 1, "sr50": 1, "sr75": 1}
    for path in ("GOT-10k/val", "GOT-10k/val/GOT-10k_Val_00000?"):
        described = json.loads(trackmark("describe", path, "--json").stdout)
        assert [name[-1] for name in described["sequence_names"]] == ["1", "2"]


def test_copy_of_otb_is_a_table_with_both_targets_of_a_folder(trackmark, scores, otb100):
    described = trackmark("describe", "OTB100").stdout
    assert "OTB-100: 3 of 100 sequences, missing: Basketball, Biker" in " ".join(described.split())
    text, by_measure = scores("OTB100", "otb", "otb")
    for name in ("Jogging.1", "Jogging.2", "Walking"):
        assert name in text
    assert len(text.splitlines()) <= 20
    assert by_measure["success_auc"] == pytest.approx(20 / 21)


def test_incomplete_copy_is_one_message(trackmark, one_line, vot2016, got10k):
    def message(path):
        return one_line(trackmark("run", "--trackers", "static", "--sequences", path, status=2))

    for image in (vot2016 / "bolt").glob("*.jpg"):
        image.unlink()
    assert "It contains 'groundtruth.txt, occlusion.label'" in message("vot2016/bolt")
    assert "(VOT)" in message("vot2016/bolt")
    (got10k / "GOT-10k_Val_000001" / "groundtruth.txt").unlink()
    assert "there is no ground truth" in message("GOT-10k/val/GOT-10k_Val_000001")
    (vot2016 / "racing" / "groundtruth.txt").rename(vot2016 / "racing" / "truth.txt")
    assert "truth.txt is not read" in message("vot2016/racing")
    assert "Did you mean 'GOT-10k/val'?" in message("GOT-10k/vale")
