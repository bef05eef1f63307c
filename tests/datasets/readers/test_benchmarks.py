"""Benchmarks: properties of each format, and mistakes in its files."""

import shutil

import numpy as np
import pytest

from tests.datasets.readers import layouts
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.layouts import layouts as table

NAN = [np.nan] * 4
TWO_BOXES = [[1, 2, 8, 9], [2, 2, 8, 9], NAN]


def parametrize_layouts(*excluded):
    """Parametrize a test with all benchmarks except some."""
    selected = [layout for layout in layouts.BENCHMARKS if layout not in excluded]
    return pytest.mark.parametrize("layout", selected, ids=lambda layout: layout.__name__)


@pytest.fixture
def create(tmp_path, write_images):
    """Write a benchmark into an empty folder with changed files, and return its paths."""

    def write(layout, changes=None):
        for entry in tmp_path.iterdir():
            shutil.rmtree(entry)
        recording = layout(tmp_path, write_images, None)
        for name, text in (changes or {}).items():
            file = next(iter(tmp_path.rglob(name)), recording.path / name)
            file.unlink() if text is None else file.write_text(text)
        return recording

    return write


@pytest.fixture
def load(create):
    """Open a benchmark after changes of its files."""
    return lambda layout, changes=None: datasets.load(create(layout, changes).path)


def refused(message):
    """Expect a refusal in one line."""
    return pytest.raises(SequenceError, match=rf"^[^\n]*{message}[^\n]*$")


def lines_of(file):
    return file.read_text().splitlines(keepends=True)


@parametrize_layouts()
def test_boxes_count_from_zero_and_absence_is_nan(load, layout):
    sequence = load(layout)
    expected = {
        layouts.vot_classic: [[1, 2, 8, 6], [1, 2, 8, 6], NAN],
        layouts.vot_current: [[3, 4, 5, 3], [2, 3, 8, 9], NAN],
    }.get(layout, TWO_BOXES)
    np.testing.assert_array_equal(sequence.boxes, expected)
    assert sequence.present.tolist() == [True, True, False]
    assert sequence.name == "walk"
    assert layout.__name__.partition("_")[0][:3] in sequence.origin.format.lower().replace("-", "")
    assert sequence.origin.citation


class TestMissingFiles:
    @parametrize_layouts(layouts.mot, layouts.nfs, layouts.tlp)  # their rows have frame numbers
    def test_fewer_rows_than_images_are_refused(self, create, layout):
        path, truth, _ = create(layout)
        # The length of these files would reveal the missing row.
        for pattern in ("*.label", "full_occlusion.txt", "out_of_view.txt"):
            for file in path.glob(pattern):
                file.unlink()
        if layout is layouts.got10k:
            (path / "cover.label").write_text("8\n3\n")
        truth.write_text("".join(lines_of(truth)[::2]))
        message = rf"{truth.name}: 2 rows for .*3 images"
        if layout is not layouts.tcolor128:
            message += r".*Add the missing row.*move the images after 0*[12]\.jpg"
        with refused(message):
            datasets.load(path)

    @parametrize_layouts()
    def test_empty_line_inside_ground_truth_is_refused(self, create, layout):
        path, truth, _ = create(layout)
        rows = lines_of(truth)
        truth.write_text("".join([rows[0], "\n", *rows[2:]]))
        with refused(rf"{truth.name}: line 2 is empty\. .*Add the row"):
            datasets.load(path)

    @parametrize_layouts(layouts.tcolor128, layouts.uav123)  # they state a range of images
    def test_missing_image_is_refused_by_name(self, create, layout):
        path, _, frame = create(layout)
        frame.unlink()
        with refused(rf"{frame.name}: this image is missing between"):
            datasets.load(path)

    @parametrize_layouts(layouts.tcolor128)
    @pytest.mark.parametrize("n_rows", [3, 2])
    def test_missing_first_image_is_refused_by_name(self, create, layout, n_rows):
        path, truth, frame = create(layout)
        truth.write_text("".join(lines_of(truth)[:n_rows]))
        first = sorted(frame.parent.glob("*.jpg"))[0]
        first.unlink()
        with refused(rf"{first.name}: this image is missing; the first"):
            datasets.load(path)

    @parametrize_layouts()
    def test_copied_image_is_refused_by_name(self, create, write_images, layout):
        path, _, frame = create(layout)
        write_images(frame.parent, [f"{frame.stem} copy.jpg"])
        with refused(rf"{frame.stem} copy\.jpg"):
            datasets.load(path)


class TestVot:
    def test_tags_and_values_are_read(self, load):
        tags = load(layouts.vot_classic).attributes
        assert {key: flags.tolist() for key, flags in tags.items()} == {
            "camera_motion": [True, False, False],
            "occlusion": [False, True, True],
        }
        sequence = load(layouts.vot_current)
        assert sequence.frame_values["anchor"].tolist() == [1, 0, -1]
        assert sequence[1:].frame_values["anchor"].tolist() == [0, -1]
        assert sequence.fps == 25

    def test_shapes_are_polygons_and_masks(self, load):
        polygons = load(layouts.vot_classic).shapes
        assert polygons[1].tolist() == [[2.5, 2], [9, 3], [8, 8], [1, 7]]
        assert polygons[2] is None
        sequence = load(layouts.vot_current)
        expected = np.zeros(layouts.SIZE[::-1], bool)
        expected[4:7, 3:8] = True
        expected[5, 5] = expected[6, 7] = False
        np.testing.assert_array_equal(sequence.mask(0), expected)
        np.testing.assert_array_equal(sequence.shapes[0], expected)
        np.testing.assert_array_equal(sequence[::-1].shapes[2], expected)
        assert sequence.mask(1) is sequence.shapes[1] is sequence[1:].shapes[0] is None
        empty = load(layouts.vot_current, {"groundtruth.txt": "2,3,8,9\nm0,0,0,0,0\n0\n"})
        assert empty.present.tolist() == [True, False, False]
        assert not empty.mask(1).any()

    def test_shapes_are_dropped_by_filters_that_move_the_target(self, create):
        path, _, _ = create(layouts.vot_classic)
        dim = datasets.load(f"{path}:filter.gain=0.5:filter.noise=3")
        assert dim.shapes[1].tolist() == [[2.5, 2], [9, 3], [8, 8], [1, 7]]
        assert datasets.load(f"{path}:filter.size=6").shapes is None

    def test_each_object_is_a_sequence(self, create, tmp_path):
        walk, truth, _ = create(layouts.vot_current)
        truth.rename(walk / "groundtruth_1.txt")
        (walk / "groundtruth_2.txt").write_text("4,5,6,7\n" * 3)
        paths = datasets.matching(str(tmp_path))
        assert [datasets.load(path).name for path in paths] == ["walk_1", "walk_2"]
        assert datasets.load(paths[1]).boxes.tolist() == [[4, 5, 6, 7]] * 3
        assert datasets.load(walk).name == "walk_1"
        with refused(r"no object '3'\. Values: 1, 2\."):
            datasets.load(f"{walk}:object=3")
        (walk / "groundtruth_2.txt").unlink()
        assert datasets.load(walk).name == "walk"

    def test_fingerprint_depends_on_the_polygon(self, load):
        before = load(layouts.vot_classic).fingerprint
        rotated = {"groundtruth.txt": "1,3,9,2,9,8,1,8\n2.5,2,9,3,8,8,1,7\n0\n"}
        assert load(layouts.vot_classic, rotated).fingerprint != before

    @pytest.mark.parametrize("layout", [layouts.vot_classic, layouts.got10k])
    def test_truth_csv_in_the_folder_has_priority(self, load, layout):
        sequence = load(layout, {"truth.csv": "frame,x,y,width,height\n0,9,8,7,6\n1,9,8,7,6\n"})
        assert sequence.boxes.tolist() == [[9, 8, 7, 6]] * 2
        assert sequence.shapes is None
        assert "truth.csv" in sequence.origin.format

    def test_special_codes_have_their_meaning(self, load):
        sequence = load(layouts.vot_current, {"groundtruth.txt": "2,3,8,9\n0\n1\n"})
        assert sequence.annotated.tolist() == [True, False, True]
        assert sequence.present.tolist() == [True, False, False]
        with refused("line 2: '2' is not a region"):
            load(layouts.vot_current, {"groundtruth.txt": "2,3,8,9\n2\n1\n"})

    def test_published_vot_sequence_without_last_row_is_accepted(self, tmp_path, write_images):
        write_images(tmp_path / "ball", [f"{i:08}.jpg" for i in range(1, 603)], (16, 12))
        (tmp_path / "ball/groundtruth.txt").write_text("1,1,5,5\n" * 601)
        assert len(datasets.load(tmp_path / "ball")) == 601
        (tmp_path / "ball/groundtruth.txt").write_text("1,1,5,5\n" * 600)
        with refused("600 rows for 602 images"):
            datasets.load(tmp_path / "ball")

    def test_licence_file_is_named(self, load):
        assert load(layouts.vot_classic).origin.licence == ""
        licence = load(layouts.vot_classic, {"LICENSE.txt": "free"}).origin.licence
        assert licence.endswith("walk/LICENSE.txt")


class TestGot10k:
    def test_labels_are_visibility_and_attributes(self, load):
        sequence = load(layouts.got10k)
        assert sequence.visibility.tolist() == [1, 0.375, 0]
        levels = [[0, 0.075, 0.225], [0.375, 0.525, 0.675], [0.825, 0.95, 1]]
        for number, centres in enumerate(levels):
            labels = "".join(f"{3 * number + k}\n" for k in range(3))
            assert load(layouts.got10k, {"cover.label": labels}).visibility.tolist() == centres
        assert sequence.attributes["cut_by_image"].tolist() == [False, True, False]
        assert (sequence.fps, sequence.origin.description) == (10, "dog, running")

    def test_any_label_distinguishes_got10k_from_vot(self, load):
        only_absence = {"meta_info.ini": None, "cover.label": None, "cut_by_image.label": None}
        assert load(layouts.got10k, only_absence).boxes[0].tolist() == [1, 2, 8, 9]

    @pytest.mark.parametrize(
        "changes",
        [
            {"groundtruth.txt": "2,3,8,9\n-1,-1,-1,-1\n4,3,8,9\n"},
            {"groundtruth.txt": "2,3,8,9\n", "absence.label": None, "cover.label": None},
        ],
    )
    def test_negative_size_and_missing_rows_of_test_sets_are_absence(self, load, changes):
        assert load(layouts.got10k, changes).present.tolist() == [True, False, False]


def test_lasot_target_is_absent_if_occluded_or_out_of_view(load):
    sequence = load(layouts.lasot, {"full_occlusion.txt": "0\n1\n0\n"})
    assert sequence.present.tolist() == [True, False, False]
    assert sequence.attributes["out_of_view"].tolist() == [False, False, True]
    assert sequence.origin.description == "a dog that walks"
    assert "research" in sequence.origin.licence


class TestNfs:
    def test_frame_rate_is_an_option(self, create, write_images):
        path, truth, _ = create(layouts.nfs)
        rows = "".join(f"0 {i} 0 {i + 4} 5 {i} 0 1 0 x\n" for i in range(24))
        write_images(path / "240" / "walk", [f"{i:05}.jpg" for i in range(1, 25)])
        (path / "240" / "walk.txt").write_text(rows)
        fast = datasets.load(f"{path}:fps=240")
        assert (fast.name, fast.fps, len(fast)) == ("walk:fps=240", 240, 24)
        assert datasets.load(path / "240").name == fast.name
        assert fast.attributes["occlusion"].all()
        truth.write_text(rows)  # 240 frames/s for images at 30 frames/s
        slow = datasets.load(path)
        assert slow.boxes.tolist() == [[0, 0, 4, 5], [8, 0, 4, 5], [16, 0, 4, 5]]
        assert (slow.name, slow.fps) == ("walk", 30)
        truth.write_text(rows + "0 24 0 28 5 24 0 1 0 x\n")  # incomplete group without image
        assert datasets.load(path).boxes.tolist() == slow.boxes.tolist()

    @pytest.mark.parametrize("step", [1, 8])
    def test_gap_in_frame_numbers_is_refused(self, create, write_images, step):
        path, truth, frame = create(layouts.nfs)
        write_images(frame.parent, [f"{i:05}.jpg" for i in range(1, 6)])
        rows = [f"0 1 2 9 11 {step * i} 0 0 0 x\n" for i in range(5)]
        truth.write_text("".join(rows))
        assert len(datasets.load(path)) == 5
        truth.write_text("".join(rows[:2] + rows[3:]))
        with refused(rf"line 3: frame {step * 3} follows frame {step}.* {step} apart"):
            datasets.load(path)

    def test_missing_first_row_is_refused_and_last_row_accepted(self, create):
        path, truth, _ = create(layouts.nfs)
        rows = lines_of(truth)
        truth.write_text("".join(rows[1:]))
        with refused(r"walk\.txt: line 1: frame 8 is the first"):
            datasets.load(path)
        truth.write_text("".join(rows[:-1]))
        assert len(datasets.load(path)) == 2

    def test_missing_last_image_is_refused(self, create):
        path, _, frame = create(layouts.nfs)
        frame.with_name("00003.jpg").unlink()
        with refused(r"walk\.txt: 3 ground-truth rows for 2 images"):
            datasets.load(path)


class TestMot:
    def test_target_is_an_option(self, create):
        path, _, _ = create(layouts.mot)
        other = datasets.load(f"{path}:target=9")
        assert other.name == "walk:target=9"
        np.testing.assert_array_equal(other.boxes, [NAN, [4, 4, 8, 9], NAN])
        np.testing.assert_array_equal(other.visibility, [np.nan, 0.25, np.nan])
        assert other.fps == 14
        with refused(r"there is no target '12'\. Values: 7, 9"):  # 12 has counts 0
            datasets.load(f"{path}:target=12")

    @pytest.mark.parametrize(
        "row", ["{0},0,2,3,8,9,1\n", "{0},0,2,3,8,9,1,1\n", "{0},0,2,3,8,9,1,1,-1\n"]
    )
    def test_files_of_other_tools_are_read(self, load, row):
        sequence = load(layouts.mot, {"gt.txt": "".join(map(row.format, (1, 3)))})
        np.testing.assert_array_equal(sequence.boxes, [[1, 2, 8, 9], NAN, [1, 2, 8, 9]])
        assert sequence.annotated.all()
        assert np.isnan(sequence.visibility).all()

    def test_images_named_by_cvat_count_from_zero(self, create):
        path, _, frame = create(layouts.mot)
        for file in sorted(frame.parent.iterdir()):
            file.rename(file.with_stem(f"frame_{int(file.stem) - 1:06}"))
        assert datasets.load(path).frame_name(0) == "frame_000000.jpg"
        frame.with_name("frame_000001.jpg").unlink()
        with refused(r"frame_000001\.jpg: this image is missing between"):
            datasets.load(path)

    def test_missing_last_image_without_target_is_refused(self, create):
        path, _, frame = create(layouts.mot)
        frame.with_name("000003.jpg").unlink()
        with refused(r"seqinfo\.ini: seqLength is '3', .* 2 images"):
            datasets.load(path)


class TestUav123:
    def test_part_of_a_folder_has_the_images_listed_in_ranges(self, tmp_path, write_images):
        first, last = table()["uav123"].image_ranges["car8"][1]
        folder = tmp_path / "data_seq/UAV123/car8"
        write_images(folder, [f"{first + i:06}.jpg" for i in range(3)], (16, 12))
        (tmp_path / "anno/UAV123").mkdir(parents=True)
        (tmp_path / "anno/UAV123/car8_2.txt").write_text("1,1,5,5\n" * 3)
        with refused(rf"no image {first + 3} in .*Expected: images {first} to {last}"):
            datasets.load(tmp_path / "car8_2")
        write_images(folder, [f"{first:06} (1).jpg"], (16, 12))
        with refused(f"same frame number as {first:06}"):
            datasets.load(tmp_path / "car8_2")

    def test_sequences_are_selected_by_root_and_pattern(self, create, tmp_path):
        path, _, _ = create(layouts.uav123)
        assert datasets.matching(str(tmp_path)) == [str(path)]
        assert datasets.matching(str(tmp_path / "w*k")) == [str(path)]
        (file,) = datasets.matching(str(tmp_path / "anno/UAV123"))
        assert datasets.load(file).name == "walk"


def test_trackingnet_and_lasot_folders_select_their_sequences(tmp_path, write_images):
    path, _, _ = layouts.trackingnet(tmp_path / "net", write_images, None)
    for folder in ("net", "net/TRAIN_0"):
        assert datasets.matching(str(tmp_path / folder)) == [str(path)]
    layouts.lasot(tmp_path / "dog", write_images, None)
    (tmp_path / "dog/walk").rename(tmp_path / "dog/dog-2")
    assert datasets.matching(str(tmp_path / "dog")) == [str(tmp_path / "dog/dog-2")]


MISTAKES = {
    "polygon": (layouts.vot_classic, "groundtruth.txt", "1,2,3,4,5\n", "line 1: .* is not a regi"),
    "NaN": (layouts.vot_classic, "groundtruth.txt", "1,2,3,4,5,nan\n", "line 1: .* is not a regi"),
    "tag": (layouts.vot_classic, "occlusion.label", "0\n7\n", "line 2: '7' is not an integer"),
    "empty": (layouts.vot_classic, "occlusion.label", "0\n\n1\n", "line 2 is empty"),
    "runs": (layouts.vot_current, "groundtruth.txt", "m3,4,5,3,0,7,1,6\n", "line 1: the runs have"),
    "size": (layouts.vot_current, "groundtruth.txt", "m0,0,9999,9999,9\n", "not lie inside"),
    "digits": (layouts.vot_current, "groundtruth.txt", "1_0,2,3,4\n", "line 1: '1_0,2,3,4' is no"),
    "mixed": (layouts.vot_current, "groundtruth.txt", "1,5 2,5 8,0 9,0\n", "line 1: .* mixes sep"),
    "spaced": (layouts.tlp, "groundtruth_rect.txt", "1, 1,5, 2, 8, 9, 0\n", "line 1: .* mixes sep"),
    "padded": (layouts.vot_current, "groundtruth.txt", "1,05,2,50,8,00,9,00\n", "leading zeros"),
    "halves": (layouts.vot_current, "groundtruth.txt", "1,5,2,5,8,0,9,0\n" * 3, "decimal commas"),
    "range form": (layouts.tcolor128, "walk_frames.txt", "4, 6,0\n", "line 1: .* mixes sep"),
    "track": (layouts.nfs, "walk.txt", "0 1,5 2,5 9 11 0 0 0 0 x\n", "line 1: .* mixes sep"),
    "rate": (layouts.vot_current, "sequence", "fps=fast\n", "fps is 'fast'"),
    "folder": (layouts.vot_current, "sequence", "groundtruth=../x\n", "groundtruth is '../x'"),
    "labels": (layouts.got10k, "cover.label", "8\n8\n", "2 values for 3 rows"),
    "cover": (layouts.got10k, "cover.label", "8\n9\n0\n", "line 2: '9' is not an integer"),
    "flag": (layouts.lasot, "out_of_view.txt", "0,x,0", "line 1: '0,x,0' is not"),
    "range": (layouts.tcolor128, "walk_frames.txt", "4,7\n", "there is no image 7"),
    "rows": (layouts.tcolor128, "walk_gt.txt", "2,3,8,9\n" * 2, "2 rows for 3 images"),
    "frame": (layouts.tlp, "groundtruth_rect.txt", "2,1,1,5,5,0\n", "line 1: frame 2"),
    "vatic": (layouts.nfs, "walk.txt", "0 1 2 9 11 0 0 0 2 x\n", "line 1: .* not a row of NfS"),
    "order": (layouts.nfs, "walk.txt", "0 1 2 9 9 4 0 0 0 x\n" * 2, "line 2: frame 4 follows"),
    "width": (
        layouts.mot,
        "gt.txt",
        "1,7,2,3,-8,9,1,1,1\n2,7,2,3,-8,9,1,1,1\n",
        "line 1: the box has a negative size, as 2 of 2 rows",
    ),
    "twice": (layouts.mot, "gt.txt", "1,7,2,3,8,9,1,1,1\n" * 2, "line 2: 1,7,2,3,8,9"),
    "late": (layouts.mot, "gt.txt", "4,7,2,3,8,9,1,1,1\n", "target 7 is in frame 4"),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistake_in_a_file_is_refused_with_its_line(load, case):
    layout, name, text, message = MISTAKES[case]
    with refused(rf"{name}: [^\n]*{message}"):
        load(layout, {name: text})
