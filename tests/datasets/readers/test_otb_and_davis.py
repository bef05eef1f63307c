"""Sequences of the Object Tracking Benchmark (OTB) and of DAVIS."""

import cv2
import numpy as np
import pytest
from PIL import Image

from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.readers.otb import SPANS

OTB_ROWS = "11,21,30,40\n12.5,22,30,41\n13,23,31,42\n"
OTB_BOXES = [[10, 20, 30, 40], [11.5, 21, 30, 41], [12, 22, 31, 42]]
PARTIAL = {name: span for name, span in SPANS.items() if span[1] is not None}


@pytest.fixture
def write_numbered(tmp_path, write_images):
    """Write an OTB folder with some images and rows; all images are hard links of one file."""

    def write(name, n_images, n_rows, first=1):
        folder = tmp_path / name
        image = folder / "img" / f"{first:04}.jpg"
        write_images(image.parent, [image.name], (16, 12))
        for number in range(first + 1, first + n_images):
            image.with_stem(f"{number:04}").hardlink_to(image)
        (folder / "groundtruth_rect.txt").write_text("1,1,5,5\n" * n_rows)
        return folder

    return write


@pytest.mark.parametrize(
    "text",
    [
        OTB_ROWS,
        OTB_ROWS.replace(",", "\t"),
        OTB_ROWS.replace(",", ", "),
        OTB_ROWS.replace(",", " \t").replace("\n", "  \r\n"),
        "\ufeff" + OTB_ROWS.replace("\n", "\r\n") + "\r\n\r\n",
        OTB_ROWS.rstrip(),
        "11, 21, 30, 40\n12.5 22\t30 41\n  13.0,23.0,31.0,42.0\n",
    ],
)
def test_boxes_are_read_with_any_separator(write_otb, tmp_path, text):
    sequence = datasets.load(write_otb(tmp_path / "Dog", text))
    assert sequence.name == "Dog"
    assert sequence.frame_name(2) == "0003.jpg"
    assert sequence.boxes.tolist() == OTB_BOXES


@pytest.mark.parametrize("absent", ["NaN,NaN,NaN,NaN", "nan nan nan nan", "0,0,0,0", "5,5,0,9"])
def test_rows_of_nan_or_without_size_mean_absence(write_otb, tmp_path, absent):
    sequence = datasets.load(write_otb(tmp_path / "Dog", f"1,1,5,5\n{absent}\n2,2,5,5\n"))
    assert sequence.present.tolist() == [True, False, True]
    assert np.isnan(sequence.boxes[1]).all()


def test_first_row_of_nan_means_absence(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", "NaN NaN NaN NaN\n2,2,5,5\n3,3,5,5"))
    assert sequence.first_frame == 1


@pytest.mark.parametrize("first", ["5,5,0,9", "0,0,0,0", "5,5,-3,9"])
def test_first_row_without_size_is_not_runnable(write_otb, tmp_path, first):
    sequence = datasets.load(write_otb(tmp_path / "Dog", f"{first}\n2,2,5,5\n3,3,5,5\n"))
    assert sequence.first_frame == 0
    with pytest.raises(SequenceError, match=r"groundtruth_rect\.txt: the first box, of 0001\.jpg"):
        sequence.check_runnable()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3,4\n1,2,3\n", "line 2: '1,2,3' is not a box"),
        ("1,2,3,4,5,6,7,8\n", "line 1: .* is not a box"),
        ("1,2,3,4\n\n1,2,3,4\n", "line 2 is empty"),
        ("x,y,w,h\n1,2,3,4\n", "line 1: 'x,y,w,h' is not a box"),
        ("1,2,inf,4\n", "line 1: .* is not a box"),
        ("1,2,3,4\n1,2,-3,4\n1,2,3,-4\n", "line 2: the box has a negative size, as 2 of 3 rows"),
        ("", "there are no rows"),
        ("1,2,3,4\n" * 2, "2 rows for 3 images"),
        ("1,2,3,4\n" * 4, "4 ground-truth rows for 3 images of Dog"),
    ],
)
def test_mistake_in_ground_truth_is_refused_with_its_line(write_otb, tmp_path, text, message):
    folder = write_otb(tmp_path / "Dog", text)
    with pytest.raises(SequenceError, match=rf"groundtruth_rect\.txt: {message}"):
        datasets.load(folder)


def test_tags_are_attributes_of_all_frames(write_otb, tmp_path):
    sequence = datasets.load(write_otb(tmp_path / "Dog", OTB_ROWS, attrs="SV, DEF,IPR\n"))
    assert list(sequence.attributes) == ["SV", "DEF", "IPR"]
    assert all(flags.tolist() == [True] * 3 for flags in sequence.attributes.values())
    before = sequence.fingerprint
    (tmp_path / "Dog" / "attrs.txt").write_text("SV, FM")
    assert datasets.load(tmp_path / "Dog").fingerprint != before


class TestPublishedParts:
    @pytest.mark.parametrize("name", PARTIAL)
    def test_annotated_part_of_the_images_is_read(self, write_numbered, name):
        first, last = SPANS[name]
        n_rows = last - first + 1
        folder = write_numbered(name.capitalize(), last + 5, n_rows)
        sequence = datasets.load(folder)
        assert (len(sequence), sequence.frame_name(0)) == (n_rows, f"{first:04}.jpg")
        assert sequence.n_unread_images == 5
        before = sequence.fingerprint
        last_image = folder / "img" / f"{last + 5:04}.jpg"
        last_image.unlink()
        last_image.write_bytes(b"not an image")
        assert datasets.load(folder).fingerprint == before

    @pytest.mark.parametrize("name", ["Football1", "David"])
    def test_annotated_part_with_a_missing_row_is_refused(self, write_numbered, name):
        first, last = SPANS[name.lower()]
        folder = write_numbered(name, last + 5, last - first)
        with pytest.raises(SequenceError, match=rf"{last - first} rows for .* images"):
            datasets.load(folder)

    @pytest.mark.parametrize(
        ("name", "first", "missing"),
        [
            ("Dog", 0, None),
            ("David", 1, None),  # a renumbered part
            ("BlurCar1", 247, None),
            ("BlurCar3", 3, None),
            ("BlurCar4", 18, None),
            ("Dog", 2, "0001"),
            ("BlurCar3", 4, "0003"),
        ],
    )
    def test_first_image_has_the_published_number(self, write_numbered, name, first, missing):
        folder = write_numbered(name, 3, 3, first)
        if missing is None:
            assert datasets.load(folder).frame_name(0) == f"{first:04}.jpg"
        else:
            with pytest.raises(SequenceError, match=rf"{missing}\.jpg: this image is missing; the"):
                datasets.load(folder)

    def test_additional_image_0_is_refused(self, write_numbered):
        folder = write_numbered("Dog", 4, 3, first=0)
        match = r"0000\.jpg: 3 ground-truth rows for 4 images of Dog"
        with pytest.raises(SequenceError, match=match):
            datasets.load(folder)

    def test_missing_inner_image_is_refused(self, write_numbered):
        folder = write_numbered("Dog", 5, 4)
        (folder / "img" / "0002.jpg").unlink()
        with pytest.raises(SequenceError, match=r"0002\.jpg: this image is missing between 0001\."):
            datasets.load(folder)


def test_each_target_of_a_folder_is_a_sequence(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Jogging", OTB_ROWS)
    (folder / "groundtruth_rect.txt").rename(folder / "groundtruth_rect.1.txt")
    (folder / "groundtruth_rect.2.txt").write_text("7,8,9,10\n" * 3)
    write_otb(tmp_path / "Dog", OTB_ROWS)
    paths = datasets.matching(str(tmp_path))
    assert [datasets.load(path).name for path in paths] == ["Dog", "Jogging.1", "Jogging.2"]
    assert datasets.load(paths[2]).boxes.tolist() == [[6, 7, 9, 10]] * 3
    assert datasets.matching(str(tmp_path / "J*")) == paths[1:] == datasets.matching(str(folder))
    assert datasets.load(folder).name == "Jogging.1"
    assert datasets.options(str(folder)) == [
        {"name": "target", "default": 1, "meaning": "selected target, one of 1, 2"}
    ]
    assert datasets.options(str(tmp_path / "Dog")) == []
    with pytest.raises(SequenceError, match=r"Dog: unknown option 'object'. Options: none"):
        datasets.load(f"{tmp_path / 'Dog'}:object=2")
    with pytest.raises(SequenceError, match=r"no target '3'\. Values: 1, 2\."):
        datasets.load(f"{folder}:target=3")
    with pytest.raises(SequenceError, match="a pattern of paths takes no options"):
        datasets.matching(f"{tmp_path}/J*:target=1")
    (folder / "groundtruth_rect.1.txt").write_text("")  # as in Human4
    assert datasets.matching(str(folder)) == [str(folder)]
    sequence = datasets.load(folder)
    assert (sequence.name, sequence.boxes.tolist()) == ("Jogging.2", [[6, 7, 9, 10]] * 3)


# Colours of DAVIS: background, objects in dark red, green, yellow, …, and void.
PALETTE = [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0]] + [[64, 64, 64]] * 251
PALETTE += [[224, 224, 192]]
SIZE = (48, 32)


def blank(size=SIZE):
    return np.zeros(size[::-1], np.uint8)


def single(i):
    """Return mask i of DAVIS 2016: two separate parts that move to the right."""
    mask = blank()
    mask[10:14, 3 + i : 8 + i] = 255
    mask[12, 3 + i : 8 + i] = 0
    return mask


def several(i):
    """Return mask i of DAVIS 2017: objects 1 and 2, from frame 1 on also 3; void around 1."""
    mask = blank()
    mask[9:15, 2 + i : 9 + i] = 255
    mask[10:14, 3 + i : 8 + i] = 1
    mask[20:25, 30:33] = 2
    if i:
        mask[2:4, 40:44] = 3
    return mask


def write_palette(file, mask):
    image = Image.frombytes("P", mask.shape[::-1], mask.tobytes())
    image.putpalette(np.array(PALETTE, np.uint8).ravel().tolist())
    image.save(file)


def write_grey(file, mask):
    assert cv2.imwrite(str(file), mask)


@pytest.fixture
def write_davis(write_images, tmp_path):
    """Write a sequence with these masks, and return the root folder."""

    def write(masks, name="swan", resolution="480p", save=write_grey, size=SIZE):
        images = tmp_path / "DAVIS" / "JPEGImages" / resolution / name
        write_images(images, [f"{i:05}.jpg" for i in range(len(masks))], size)
        folder = tmp_path / "DAVIS" / "Annotations" / resolution / name
        folder.mkdir(parents=True)
        for i, mask in enumerate(masks):
            save(folder / f"{i:05}.png", mask)
        return tmp_path / "DAVIS"

    return write


@pytest.fixture
def swan(write_davis):
    """Root folder of a sequence of 2016 with four frames."""
    return write_davis([single(i) for i in range(4)])


@pytest.fixture
def pair(write_davis):
    """Root folder of a sequence of 2017 with three objects and four frames."""
    return write_davis([several(i) for i in range(4)], "pair", save=write_palette)


def images_of(root, name="swan", resolution="480p"):
    return root / "JPEGImages" / resolution / name


def masks_of(root, name="swan", resolution="480p"):
    return root / "Annotations" / resolution / name


def test_boxes_enclose_the_masks_of_the_object(swan):
    sequence = datasets.load(images_of(swan))
    assert (sequence.name, len(sequence)) == ("swan", 4)
    assert sequence.boxes.tolist() == [[3 + i, 10, 5, 4] for i in range(4)]
    for i in range(4):
        assert sequence.mask(i).dtype == np.bool_
        np.testing.assert_array_equal(sequence.mask(i), single(i) == 255)
    assert sequence[0].shape == (32, 48, 3)
    assert sequence.frame_name(2) == "00002.jpg"
    sequence.check_runnable()


def test_empty_mask_means_absence(write_davis):
    sequence = datasets.load(images_of(write_davis([blank(), single(1), blank(), single(3)])))
    assert sequence.present.tolist() == [False, True, False, True]
    assert not sequence.mask(2).any()


def test_sequence_opens_by_folder_and_by_name_in_the_root(swan, monkeypatch):
    boxes = datasets.load(images_of(swan)).boxes.tolist()
    for folder, path in (
        (swan, swan / "swan"),
        (swan, f"{images_of(swan)}/"),
        (images_of(swan), "."),
        (swan, "swan"),
    ):
        monkeypatch.chdir(folder)
        sequence = datasets.load(path)
        assert (sequence.name, sequence.boxes.tolist()) == ("swan", boxes)
    with pytest.raises(SequenceError, match="unknown sequence 'swam'"):
        datasets.load("swam")


def test_name_in_the_root_prefers_480p(swan, write_davis):
    large = [cv2.resize(single(i), (96, 64), interpolation=cv2.INTER_NEAREST) for i in range(4)]
    write_davis(large, resolution="Full-Resolution", size=(96, 64))
    write_davis(large, name="goose", resolution="Full-Resolution", size=(96, 64))
    sequence = datasets.load(images_of(swan, resolution="Full-Resolution"))
    assert sequence.boxes[1].tolist() == [8, 20, 10, 8]
    assert datasets.load(swan / "swan").boxes[1].tolist() == [4, 10, 5, 4]
    assert datasets.load(swan / "goose").boxes[1].tolist() == [8, 20, 10, 8]


@pytest.mark.parametrize(
    ("option", "number", "name", "box"),
    [
        ("", 1, "pair", [4, 10, 5, 4]),
        (":object=1", 1, "pair", [4, 10, 5, 4]),
        (":object=2", 2, "pair:object=2", [30, 20, 3, 5]),
        (":object=3", 3, "pair:object=3", [40, 2, 4, 2]),
    ],
)
def test_object_is_selected_by_its_number(pair, option, number, name, box):
    for path in (pair / "pair", images_of(pair, "pair")):
        sequence = datasets.load(f"{path}{option}")
        assert sequence.name == name
        assert sequence.boxes[1].tolist() == box
        np.testing.assert_array_equal(sequence.mask(1), several(1) == number)
        assert sequence.present.tolist() == [number != 3, True, True, True]


def test_options_list_the_objects(pair, swan):
    (option,) = datasets.options(str(pair / "pair"))
    assert option == {"name": "object", "default": 1, "meaning": "selected object, one of 1, 2, 3"}
    assert datasets.options(f"{pair / 'pair'}:object=2") == [option]
    (option,) = datasets.options(str(swan / "swan"))
    assert option["meaning"] == "selected object, one of 1"
    assert datasets.load(f"{swan / 'swan'}:object=1").name == "swan"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (":object=4", r"pair: there is no object '4'\. Values: 1, 2, 3\."),
        (":object=255", "pair: there is no object '255'"),
        (":object=one", "pair: there is no object 'one'"),
        (":colour=2", r"pair: unknown option 'colour'\. Options: object\."),
        (":object", "unknown sequence"),
    ],
)
def test_invalid_option_is_refused_with_the_valid_values(pair, option, message):
    with pytest.raises(SequenceError, match=rf"^[^\n]*{message}[^\n]*$"):
        datasets.load(f"{pair / 'pair'}{option}")


def test_masks_are_read_from_grey_palette_and_bit_images(write_davis):
    masks = [several(i) for i in range(2)]
    grey = datasets.load(write_davis(masks, "grey") / "grey")
    palette = datasets.load(write_davis(masks, "palette", save=write_palette) / "palette")
    for i in range(2):
        np.testing.assert_array_equal(grey.mask(i), palette.mask(i))

    def write_bits(file, mask):
        Image.fromarray(mask > 0).save(file)

    bits = datasets.load(write_davis([single(0), single(1)], "bits", save=write_bits) / "bits")
    np.testing.assert_array_equal(bits.mask(1), single(1) > 0)


def damage(file, change):
    data = bytearray(file.read_bytes())
    file.write_bytes(change(data) or data)


def flip_bit(data):
    data[len(data) // 2] ^= 16


DAMAGES = {
    "missing mask": (
        lambda images, masks: (masks / "00002.png").unlink(),
        "00002.png: this mask is missing. Expected: one mask per image",
    ),
    "missing masks": (
        lambda images, masks: [file.unlink() for file in masks.iterdir()],
        "00000.png: this mask is missing",
    ),
    "additional mask": (
        lambda images, masks: write_grey(masks / "00004.png", single(4)),
        "00004.png: the mask has no image",
    ),
    "missing image": (
        lambda images, masks: (images / "00001.jpg").unlink(),
        "00001.jpg: this image is missing between 00000.jpg and 00002.jpg",
    ),
    "no images": (
        lambda images, masks: [file.unlink() for file in images.iterdir()],
        "there are no images",
    ),
    "image without number": (
        lambda images, masks: (images / "00003.jpg").rename(images / "last.jpg"),
        "last.jpg: the name is not a number",
    ),
    "mask of another size": (
        lambda images, masks: write_grey(masks / "00002.png", blank((40, 32))),
        "00002.png: the mask has 40x32 pixels, the images have 48x32",
    ),
    "colour mask": (
        lambda images, masks: write_grey(masks / "00002.png", np.dstack([single(2)] * 3)),
        "00002.png: the mask is a colour image",
    ),
    "damaged mask": (
        lambda images, masks: damage(masks / "00002.png", flip_bit),
        "00002.png: the mask cannot be read",
    ),
    "truncated mask": (
        lambda images, masks: damage(masks / "00002.png", lambda data: data[:60]),
        "00002.png: the mask cannot be read",
    ),
    "empty masks": (
        lambda images, masks: [write_grey(file, blank()) for file in masks.iterdir()],
        "all masks are empty",
    ),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_damaged_data_are_refused_by_file(swan, case):
    change, message = DAMAGES[case]
    change(images_of(swan), masks_of(swan))
    with pytest.raises(SequenceError, match=rf"^[^\n]*480p/swan.*{message}[^\n]*$"):
        datasets.load(images_of(swan))


def test_sequence_without_masks_is_a_folder_of_images(swan):
    for file in masks_of(swan).iterdir():
        file.unlink()
    masks_of(swan).rmdir()
    sequence = datasets.load(images_of(swan))
    assert len(sequence) == 4
    with pytest.raises(SequenceError, match="no ground truth"):
        sequence.check_runnable()


def test_fingerprint_depends_on_masks_and_object(pair):
    def fingerprint(option=""):
        return datasets.load(f"{pair / 'pair'}{option}").fingerprint

    before = fingerprint()
    assert fingerprint() == before != fingerprint(":object=2")
    mask = several(1)
    mask[12, 6] = 0  # the box does not change
    write_palette(masks_of(pair, "pair") / "00001.png", mask)
    assert fingerprint() != before
