"""A copy of a benchmark, as users have it: one path gives a table."""

import csv
import shutil

import cv2
import numpy as np
import pytest

N = 15
CORNERS = np.array([[20, 20], [25, 15], [30, 20], [25, 25]])
PIXELS_OF_CORNERS = 61  # of the square on its corner, its edges among them
RUNS = [0, *[1, 9] * 9, 10]  # an L of 19 pixels in a box of 10 times 10


def images(folder, names):
    folder.mkdir(parents=True)
    for i, name in enumerate(names):
        image = np.random.default_rng(i).integers(0, 256, (40, 50, 3), dtype=np.uint8)
        assert cv2.imwrite(str(folder / name), image)


def lines(folder, texts):
    for name, rows in texts.items():
        (folder / name).write_text("".join(f"{row}\n" for row in rows))


def numbered(digits, first=1):
    return [f"{first + i:0{digits}}.jpg" for i in range(N)]


@pytest.fixture
def vot2016(here):
    """Images beside the truth, and polygons."""
    for name, shift in (("bolt", 0), ("racing", 3)):
        folder = here / "vot2016" / name
        images(folder, numbered(8))
        polygon = ",".join(map(str, (CORNERS + shift).ravel().tolist()))
        lines(folder, {"groundtruth.txt": [polygon] * N, "occlusion.label": [0, 1] + [0] * 9})
    lines(here / "vot2016", {"list.txt": ["bolt", "racing"]})
    return here / "vot2016"


@pytest.fixture
def vot2020(here):
    """Images in a folder of their own, and masks."""
    folder = here / "workspace" / "sequences" / "agility"
    images(folder / "color", numbered(8))
    mask = ",".join(map(str, ["m20", 15, 10, 10, *RUNS]))
    lines(folder, {"groundtruth.txt": [mask] * N, "anchor.value": [1] + [0] * (N - 1)})
    lines(folder, {"sequence": ["channels.color=color/%08d.jpg", "format=default", "name=agility"]})
    lines(folder.parent, {"list.txt": ["agility"]})
    return here / "workspace" / "sequences"


@pytest.fixture
def got10k(here):
    """Two sequences of the validation set; the second's target is away for a while."""
    for number, hidden in ((1, ()), (2, (5, 6))):
        folder = here / "GOT-10k" / "val" / f"GOT-10k_Val_{number:06}"
        images(folder, numbered(8))
        lines(
            folder,
            {
                "groundtruth.txt": ["21.0000,16.0000,10.0000,10.0000"] * N,
                "absence.label": [int(i in hidden) for i in range(N)],
                "cover.label": [0 if i in hidden else 8 for i in range(N)],
                "cut_by_image.label": [0] * N,
                "meta_info.ini": ["[METAINFO]", "anno_fps: 10Hz", "resolution: (50, 40)"],
            },
        )
    lines(here / "GOT-10k" / "val", {"list.txt": ["GOT-10k_Val_000001", "GOT-10k_Val_000002"]})
    return here / "GOT-10k" / "val"


@pytest.fixture
def otb100(here):
    """A sequence of one target, and one of two."""
    for name in ("Walking", "Jogging"):
        images(here / "OTB100" / name / "img", numbered(4))
    lines(here / "OTB100" / "Walking", {"groundtruth_rect.txt": ["21\t16\t10\t10"] * N})
    for target in (1, 2):
        truth = {f"groundtruth_rect.{target}.txt": [f"{10 * target},16,10,10"] * N}
        lines(here / "OTB100" / "Jogging", truth)
    return here / "OTB100"


def overall(here, preset):
    """Scores of all sequences together, by name, as a report's file has them."""
    with (here / "report" / f"metrics-{preset}.csv").open() as file:
        return {
            row["measure"]: float(row["mean"])
            for row in csv.DictReader(file)
            if row["sequence"] == "all sequences" and row["mean"]
        }


def run(trackmark, path, metrics):
    asked = ("run", "--trackers", "static", "--name", "copy", "--sequences", path)
    return trackmark(*asked, "--metrics", metrics)


def report(trackmark, metrics):
    trackmark(
        *("report", "results/copy", "--metrics", metrics, "--folder", "report", "--no-pictures")
    )


def test_polygons_of_vot_are_scored_as_such_from_what_is_stored(trackmark, here, vot2016):
    said = run(trackmark, "vot2016", "native,vot").stdout
    assert "bolt" in said
    assert "racing" in said
    assert "read as a folder with groundtruth.txt and images or color/ (VOT)." in said
    shutil.rmtree(vot2016)
    report(trackmark, "native,vot")
    scores = overall(here, "vot-supervised")
    assert scores["accuracy_exact"] == pytest.approx(0.5)
    # A box has no pixels on its far sides, a polygon has one on each of these.
    both = PIXELS_OF_CORNERS - 2
    assert scores["accuracy"] == pytest.approx(both / (100 + PIXELS_OF_CORNERS - both))
    assert scores["failures"] == 0


def test_masks_of_vot_are_scored_as_such_from_what_is_stored(trackmark, here, vot2020):
    said = run(trackmark, vot2020, "vot-anchor").stdout
    assert "agility" in said
    shutil.rmtree(vot2020)
    report(trackmark, "vot-anchor")
    with (here / "report" / "metrics-vot-anchor.csv").open() as file:
        found = {row["measure"]: row["mean"] for row in csv.DictReader(file)}
    assert float(found["accuracy"]) == pytest.approx((N - 1) / N * 19 / 100)
    assert float(found["robustness"]) == 1


@pytest.mark.parametrize("path", ["GOT-10k/val", "GOT-10k", "GOT-10k/val/GOT-10k_Val_00000?"])
def test_a_copy_of_got10k_is_a_table_by_one_path(trackmark, here, got10k, path):
    said = run(trackmark, path, "native,got10k").stdout
    assert "GOT-10k_Val_000002" in said
    report(trackmark, "got10k")
    assert overall(here, "got10k") == {"ao": 1, "sr50": 1, "sr75": 1}


def test_a_copy_of_otb_is_a_table_by_one_path_with_both_targets_of_a_folder(
    trackmark, here, otb100
):
    said = run(trackmark, "OTB100", "otb").stdout
    for name in ("Jogging.1", "Jogging.2", "Walking"):
        assert name in said
    report(trackmark, "otb")
    assert overall(here, "otb")["success_auc"] == pytest.approx(20 / 21)


def test_what_is_missing_of_a_copy_is_a_line(trackmark, one_line, vot2016, got10k):
    def told(path):
        return one_line(run_wrong(trackmark, path))

    for image in (vot2016 / "bolt").glob("*.jpg"):
        image.unlink()
    said = told("vot2016/bolt")
    assert "there is 'groundtruth.txt, occlusion.label'" in said
    assert "(VOT)" in said
    (got10k / "GOT-10k_Val_000001" / "groundtruth.txt").unlink()
    assert "there is no truth" in told("GOT-10k/val/GOT-10k_Val_000001")
    (vot2016 / "racing" / "groundtruth.txt").rename(vot2016 / "racing" / "truth.txt")
    assert "truth.txt is of a format that isn't read" in told("vot2016/racing")
    assert "Did you mean 'GOT-10k/val'?" in told("GOT-10k/vale")


def run_wrong(trackmark, path):
    return trackmark("run", "--trackers", "static", "--sequences", path, status=2)
