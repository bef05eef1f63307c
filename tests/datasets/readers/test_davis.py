"""Sequences of DAVIS."""

import cv2
import numpy as np
import pytest
from PIL import Image

from trackmark import datasets
from trackmark.datasets import SequenceError

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
    assert option == {"name": "object", "default": 1, "meaning": "which object of 1, 2, 3"}
    assert datasets.options(f"{pair / 'pair'}:object=2") == [option]
    (option,) = datasets.options(str(swan / "swan"))
    assert option["meaning"] == "which object of 1"
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
        "00002.png: this mask is missing. Expected is one per image",
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
