"""What is particular to the layouts of benchmarks."""

import numpy as np
import pytest

from tests.datasets.readers import layouts
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.readers.uav123 import PARTS

NAN = [np.nan] * 4
TWO = [[1, 2, 8, 9], [2, 2, 8, 9], NAN]


@pytest.fixture
def opened(tmp_path, write_images):
    """Opens a layout after a change of its files, given by their ends."""

    def open_(layout, changes=None, choice=""):
        path, _, _ = layout(tmp_path, write_images, None)
        for name, text in (changes or {}).items():
            file = next(iter(tmp_path.rglob(name)), path / name)
            if text is None:
                file.unlink()
            else:
                file.write_text(text)
        return datasets.load(f"{path}{choice}")

    return open_


@pytest.mark.parametrize("layout", layouts.LAYOUTS, ids=lambda layout: layout.__name__)
def test_boxes_count_from_zero_and_an_absent_target_is_nan(opened, layout):
    sequence = opened(layout)
    expected = {
        layouts.vot_classic: [[1, 2, 8, 6], [1, 2, 8, 6], NAN],
        layouts.vot_current: [[3, 4, 5, 3], [2, 3, 8, 9], NAN],
    }.get(layout, TWO)
    np.testing.assert_array_equal(sequence.boxes, expected)
    assert sequence.present.tolist() == [True, True, False]
    assert sequence.name == "walk"
    assert layout.__name__.partition("_")[0][:3] in sequence.origin.format.lower().replace("-", "")
    assert sequence.origin.citation


class TestVot:
    def test_tags_are_attributes_and_values_values(self, opened):
        tags = opened(layouts.vot_classic).attributes
        assert {key: flags.tolist() for key, flags in tags.items()} == {
            "camera_motion": [True, False, False],
            "occlusion": [False, True, True],
        }

    def test_the_current_layout_has_values_and_a_rate(self, opened):
        sequence = opened(layouts.vot_current)
        assert sequence.values["anchor"].tolist() == [1, 0, -1]
        assert sequence[1:].values["anchor"].tolist() == [0, -1]
        assert sequence.fps == 25

    def test_a_mask_is_decoded_where_there_is_one(self, opened):
        sequence = opened(layouts.vot_current)
        mask = np.zeros((32, 48), bool)
        mask[4:7, 3:8] = True
        mask[5, 5] = mask[5, 5]
        mask.ravel()[5 * 48 + 5] = False
        assert sequence.mask(0).sum() == 13
        assert not sequence.mask(0)[5, 5]
        assert sequence.mask(1) is None
        assert sequence.mask(0)[mask].sum() == 13

    def test_polygons_and_masks_are_its_outlines(self, opened):
        classic = opened(layouts.vot_classic).shapes
        assert classic[1].tolist() == [[2.5, 2], [9, 3], [8, 8], [1, 7]]
        assert classic[2] is None
        current = opened(layouts.vot_current)
        np.testing.assert_array_equal(current.shapes[0], current.mask(0))
        assert current.shapes[1] is None
        assert current[1:].shapes[0] is None
        np.testing.assert_array_equal(current[::-1].shapes[2], current.mask(0))

    def test_outlines_stay_under_filters_that_leave_the_target_where_it_is(self, opened, tmp_path):
        opened(layouts.vot_classic)
        dim = datasets.load(f"{tmp_path / 'walk'}:filter.gain=0.5:filter.noise=3")
        assert dim.shapes[1].tolist() == [[2.5, 2], [9, 3], [8, 8], [1, 7]]
        assert datasets.load(f"{tmp_path / 'walk'}:filter.size=6").shapes is None

    def test_a_truth_of_ones_own_has_none(self, opened, tmp_path):
        opened(layouts.vot_classic)
        (tmp_path / "mine.csv").write_text("frame,x,y,width,height\n0,9,8,7,6\n")
        assert datasets.load(tmp_path / "walk", tmp_path / "mine.csv").shapes is None

    def test_objects_that_are_told_apart_are_a_sequence_each(self, opened, tmp_path):
        opened(layouts.vot_current)
        walk = tmp_path / "walk"
        (walk / "groundtruth.txt").rename(walk / "groundtruth_1.txt")
        (walk / "groundtruth_2.txt").write_text("4,5,6,7\n" * 3)
        found = datasets.matching(str(tmp_path))
        assert [datasets.load(path).name for path in found] == ["walk_1", "walk_2"]
        assert datasets.load(found[1]).boxes.tolist() == [[4, 5, 6, 7]] * 3
        assert datasets.load(walk).name == "walk_1"
        with pytest.raises(SequenceError, match=r"no object '3'\. There are: 1, 2\."):
            datasets.load(f"{walk}:object=3")
        (walk / "groundtruth_2.txt").unlink()
        assert datasets.load(walk).name == "walk"

    def test_an_empty_mask_is_an_absent_target(self, opened):
        sequence = opened(layouts.vot_current, {"groundtruth.txt": "2,3,8,9\nm0,0,0,0,0\n0\n"})
        assert sequence.present.tolist() == [True, False, False]
        assert not sequence.mask(1).any()

    def test_the_fingerprint_follows_the_polygon_not_only_its_box(self, opened):
        before = opened(layouts.vot_classic).fingerprint
        turned = {"groundtruth.txt": "1,3,9,2,9,8,1,8\n2.5,2,9,3,8,8,1,7\n0\n"}
        assert opened(layouts.vot_classic, turned).fingerprint != before

    def test_a_truth_of_ones_own_beside_the_images_wins(self, opened):
        own = {"truth.csv": "frame,x,y,width,height\n0,9,8,7,6\n"}
        sequence = opened(layouts.vot_classic, own)
        assert sequence.boxes.tolist() == [[9, 8, 7, 6]]
        assert "truth.csv" in sequence.origin.format


class TestGot10k:
    def test_cover_is_visibility_and_labels_are_attributes(self, opened):
        sequence = opened(layouts.got10k)
        assert sequence.visibility.tolist() == [1, 0.375, 0]
        levels = [[0, 0.075, 0.225], [0.375, 0.525, 0.675], [0.825, 0.95, 1]]
        for number, middles in enumerate(levels):
            labels = "".join(f"{3 * number + k}\n" for k in range(3))
            assert opened(layouts.got10k, {"cover.label": labels}).visibility.tolist() == middles
        assert sequence.attributes["cut_by_image"].tolist() == [False, True, False]
        assert (sequence.fps, sequence.origin.description) == (10, "dog, running")

    def test_any_of_its_labels_tells_it_from_vot_whose_truth_counts_from_0(self, opened):
        alone = {"meta_info.ini": None, "cover.label": None, "cut_by_image.label": None}
        assert opened(layouts.got10k, alone).boxes[0].tolist() == [1, 2, 8, 9]

    def test_a_negative_size_is_absence(self, opened):
        rows = {"groundtruth.txt": "2,3,8,9\n-1,-1,-1,-1\n4,3,8,9\n"}
        assert opened(layouts.got10k, rows).present.tolist() == [True, False, False]

    def test_behind_the_one_box_of_a_test_sequence_nothing_is_known(self, opened):
        one = {"groundtruth.txt": "2,3,8,9\n", "absence.label": None, "cover.label": None}
        sequence = opened(layouts.got10k, one)
        assert sequence.present.tolist() == [True, False, False]


def test_lasot_is_absent_where_it_is_occluded_or_out_of_view(opened):
    sequence = opened(layouts.lasot, {"full_occlusion.txt": "0\n1\n0\n"})
    assert sequence.present.tolist() == [True, False, False]
    assert sequence.attributes["out_of_view"].tolist() == [False, False, True]
    assert sequence.origin.description == "a dog that walks"
    assert "research" in sequence.origin.licence


class TestNfs:
    def test_rates_are_chosen(self, opened, tmp_path, write_images):
        path, truth, _ = layouts.nfs(tmp_path, write_images, None)
        rows = "".join(f"0 {i} 0 {i + 4} 5 {i} 0 1 0 x\n" for i in range(24))
        write_images(path / "240" / "walk", [f"{i:05}.jpg" for i in range(1, 25)])
        (path / "240" / "walk.txt").write_text(rows)
        fast = datasets.load(f"{path}:fps=240")
        assert (fast.name, fast.fps, len(fast)) == ("walk:fps=240", 240, 24)
        assert datasets.load(path / "240").name == fast.name
        assert fast.attributes["occlusion"].all()
        truth.write_text(rows)  # of all frames, for 30 images a second
        slow = datasets.load(path)
        assert slow.boxes.tolist() == [[0, 0, 4, 5], [8, 0, 4, 5], [16, 0, 4, 5]]
        assert (slow.name, slow.fps) == ("walk", 30)
        truth.write_text(rows + "0 24 0 28 5 24 0 1 0 x\n")  # one of the last eight, without image
        assert datasets.load(path).boxes.tolist() == slow.boxes.tolist()

    def test_a_missing_last_image_makes_no_shorter_sequence(self, opened, tmp_path, write_images):
        path, _, frame = layouts.nfs(tmp_path, write_images, None)
        frame.with_name("00003.jpg").unlink()
        with pytest.raises(SequenceError, match=r"walk\.txt: 3 ground-truth rows for 2 images"):
            datasets.load(path)


class TestMot:
    def test_a_target_is_chosen_and_the_longest_by_default(self, opened):
        other = opened(layouts.mot, choice=":target=9")
        assert other.name == "walk:target=9"
        np.testing.assert_array_equal(other.boxes, [NAN, [4, 4, 8, 9], NAN])
        np.testing.assert_array_equal(other.visibility, [np.nan, 0.25, np.nan])
        assert other.fps == 14
        with pytest.raises(SequenceError, match=r"there is no target '12'\. There are: 7, 9"):
            opened(layouts.mot, choice=":target=12")  # it doesn't count

    def test_a_missing_last_image_is_told_also_where_no_target_is_in_it(self, opened, tmp_path):
        opened(layouts.mot)
        (tmp_path / "walk" / "img1" / "000003.jpg").unlink()
        with pytest.raises(SequenceError, match=r"seqinfo\.ini: seqLength is '3', .* 2 images"):
            datasets.load(tmp_path / "walk")


class TestUav123:
    def test_parts_are_what_the_table_says(self, tmp_path, write_images):
        layouts.uav123(tmp_path, write_images, None)
        first, last = PARTS["car8"][1]
        folder = tmp_path / "data_seq/UAV123/car8"
        write_images(folder, [f"{first + i:06}.jpg" for i in range(3)], (16, 12))
        (tmp_path / "anno/UAV123/car8_2.txt").write_text("1,1,5,5\n" * 3)
        with pytest.raises(SequenceError, match=rf"00{first + 3}\.jpg: .* from {first} to {last}"):
            datasets.load(tmp_path / "car8_2")

    def test_a_folder_is_all_its_names_and_a_pattern_some(self, tmp_path, write_images):
        layouts.uav123(tmp_path, write_images, None)
        assert datasets.matching(str(tmp_path)) == [str(tmp_path / "walk")]
        assert datasets.matching(str(tmp_path / "w*k")) == [str(tmp_path / "walk")]
        (found,) = datasets.matching(str(tmp_path / "anno/UAV123"))
        assert datasets.load(found).name == "walk"


def test_folders_of_trackingnet_and_lasot_are_their_sequences(tmp_path, write_images):
    layouts.trackingnet(tmp_path / "net", write_images, None)
    found = datasets.matching(str(tmp_path / "net"))
    assert found == [str(tmp_path / "net/TRAIN_0/frames/walk")]
    assert datasets.matching(str(tmp_path / "net/TRAIN_0")) == found
    layouts.lasot(tmp_path / "dog", write_images, None)
    (tmp_path / "dog/walk").rename(tmp_path / "dog/dog-2")
    assert datasets.matching(str(tmp_path / "dog")) == [str(tmp_path / "dog/dog-2")]


def test_a_licence_beside_the_data_is_named(opened):
    assert opened(layouts.vot_classic).origin.licence == ""
    assert opened(layouts.vot_classic, {"LICENSE.txt": "free"}).origin.licence.endswith(
        "walk/LICENSE.txt"
    )


WRONG = {
    "polygon": (layouts.vot_classic, "groundtruth.txt", "1,2,3,4,5\n", "line 1: .* is no region"),
    "polygon of NaN": (layouts.vot_classic, "groundtruth.txt", "1,2,3,4,5,nan\n", "line 1: .* is"),
    "tag": (layouts.vot_classic, "occlusion.label", "0\n7\n", "line 2: '7' is not a whole number"),
    "runs": (layouts.vot_current, "groundtruth.txt", "m3,4,5,3,0,7,1,6\n", "line 1: the runs make"),
    "claim": (layouts.vot_current, "groundtruth.txt", "m0,0,99999,99999,9\n", "does not lie in"),
    "digits": (layouts.vot_current, "groundtruth.txt", "1_0,2,3,4\n", "line 1: '1_0,2,3,4' is no"),
    "rate": (layouts.vot_current, "sequence", "fps=fast\n", "fps is 'fast'"),
    "labels": (layouts.got10k, "cover.label", "8\n8\n", "2 values for the 3 rows"),
    "cover": (layouts.got10k, "cover.label", "8\n9\n0\n", "line 2: '9' is not a whole number"),
    "flag": (layouts.lasot, "out_of_view.txt", "0,x,0", "line 1: '0,x,0' is not"),
    "range": (layouts.tcolor128, "walk_frames.txt", "4,7\n", "there is no image 7"),
    "rows": (layouts.tcolor128, "walk_gt.txt", "2,3,8,9\n", "1 rows for the 3 images"),
    "frame": (layouts.tlp, "groundtruth_rect.txt", "2,1,1,5,5,0\n", "line 1: frame 2"),
    "vatic": (layouts.nfs, "walk.txt", "0 1 2 9 11 0 0 0 2 x\n", "line 1: .* is no row of VATIC"),
    "order": (layouts.nfs, "walk.txt", "0 1 2 9 9 4 0 0 0 x\n" * 2, "line 2: frame 4 follows"),
    "size": (layouts.mot, "gt.txt", "1,7,2,3,0,9,1,1,1\n", "line 1: 1,7,2,3,0,9,1,1,1 is no row"),
    "twice": (layouts.mot, "gt.txt", "1,7,2,3,8,9,1,1,1\n" * 2, "line 2: 1,7,2,3,8,9"),
    "far": (layouts.mot, "gt.txt", "4,7,2,3,8,9,1,1,1\n", "target 7 is in frame 4"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_mistake_is_told_with_file_and_line(opened, case):
    layout, name, text, message = WRONG[case]
    with pytest.raises(SequenceError, match=rf"^[^\n]*{name}: [^\n]*{message}[^\n]*$"):
        opened(layout, {name: text})


@pytest.mark.parametrize(
    "layout", [layouts.vot_classic, layouts.lasot, layouts.mot], ids=lambda layout: layout.__name__
)
def test_a_missing_image_is_told_and_shifts_no_truth(tmp_path, write_images, layout):
    path, _, frame = layout(tmp_path, write_images, None)
    frame.unlink()
    with pytest.raises(SequenceError, match=rf"{frame.name}: there is no such image between"):
        datasets.load(path)


@pytest.mark.parametrize(
    "layout",
    [layout for layout in layouts.LAYOUTS if layout is not layouts.tcolor128],
    ids=lambda layout: layout.__name__,
)
@pytest.mark.parametrize("beyond", [0, 1])
def test_a_missing_first_image_shifts_no_truth_either(tmp_path, write_images, layout, beyond):
    path, truth, frame = layout(tmp_path, write_images, None)
    if beyond:  # the images left are as many as the rows
        rows = truth.read_text().splitlines(keepends=True)
        truth.write_text("".join(rows[:-1]))
    first = sorted(frame.parent.glob("*.jpg"))[0]
    first.unlink()
    with pytest.raises(SequenceError, match=rf"{first.name}: there is no such image; the first"):
        datasets.load(path)


def test_every_sequence_beside_the_checkout_opens_by_its_path_alone(recorded):
    places = ("vot", "otb", "davis", "video", "video/orange-shirt")
    found = [name for place in places for name in datasets.matching(str(recorded / place))]
    assert len(found) >= 10
    for name in found:
        sequence = datasets.load(name)
        assert sequence[0].size
        assert name.endswith(".avi") or sequence.present.all()
    bag = datasets.load(recorded / "vot" / "bag")
    assert bag.boxes[0].round(2).tolist() == [292.23, 128.36, 145.96, 132.47]
    ball = datasets.load(recorded / "vot" / "ball")
    assert (len(ball), ball.images_beyond_truth, ball.attributes["camera_motion"].all()) == (
        601,
        1,
        True,
    )
