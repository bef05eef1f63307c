"""Sequences of DAVIS."""

import cv2
import numpy as np
import pytest
from PIL import Image

from trackmark import datasets
from trackmark.datasets import SequenceError

# As DAVIS has it: background, objects in dark red, green, yellow, …, and void.
PALETTE = [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0]] + [[64, 64, 64]] * 251
PALETTE += [[224, 224, 192]]
SIZE = (48, 32)


def blank(size=SIZE):
    return np.zeros(size[::-1], np.uint8)


def single(i):
    """A mask of 2016: an object of 5x4 pixels that moves to the right, two rows of it apart."""
    mask = blank()
    mask[10:14, 3 + i : 8 + i] = 255
    mask[12, 3 + i : 8 + i] = 0
    return mask


def several(i):
    """A mask of 2017: objects 1 and 2, 3 from the second frame on, and void pixels around 1."""
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
    """Writes a sequence with these masks, and gives the root."""

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
    """The root of a sequence of 2016, of four frames."""
    return write_davis([single(i) for i in range(4)])


@pytest.fixture
def pair(write_davis):
    """The root of a sequence of 2017 with three objects, of four frames."""
    return write_davis([several(i) for i in range(4)], "pair", save=write_palette)


def images_of(root, name="swan", resolution="480p"):
    return root / "JPEGImages" / resolution / name


def masks_of(root, name="swan", resolution="480p"):
    return root / "Annotations" / resolution / name


def test_boxes_enclose_the_masks_and_masks_are_the_objects_pixels(swan):
    sequence = datasets.load(images_of(swan))
    assert (sequence.name, len(sequence)) == ("swan", 4)
    assert sequence.boxes.tolist() == [[3 + i, 10, 5, 4] for i in range(4)]
    for i in range(4):
        mask = sequence.mask(i)
        assert mask.dtype == np.bool_
        np.testing.assert_array_equal(mask, single(i) == 255)
    assert sequence[0].shape == (32, 48, 3)
    assert sequence.frame_name(2) == "00002.jpg"
    sequence.check_runnable()


def test_an_empty_mask_is_an_absent_target(write_davis):
    root = write_davis([blank(), single(1), blank(), single(3)])
    sequence = datasets.load(images_of(root))
    assert sequence.present.tolist() == [False, True, False, True]
    assert np.isnan(sequence.boxes[2]).all()
    assert not sequence.mask(2).any()


def test_it_is_opened_by_its_folder_from_within_or_by_root_and_name(swan, monkeypatch):
    boxes = datasets.load(images_of(swan)).boxes.tolist()
    for path in (swan / "swan", f"{images_of(swan)}/"):
        assert datasets.load(path).boxes.tolist() == boxes
        assert datasets.load(path).name == "swan"
    monkeypatch.chdir(images_of(swan))
    assert datasets.load(".").name == "swan"
    monkeypatch.chdir(swan)
    assert datasets.load("swan").boxes.tolist() == boxes
    with pytest.raises(SequenceError, match="unknown sequence 'swam'"):
        datasets.load("swam")


def test_every_resolution_is_read_and_480p_is_what_a_name_means(swan, write_davis):
    large = [cv2.resize(single(i), (96, 64), interpolation=cv2.INTER_NEAREST) for i in range(4)]
    write_davis(large, resolution="Full-Resolution", size=(96, 64))
    write_davis(large, name="goose", resolution="Full-Resolution", size=(96, 64))
    sequence = datasets.load(images_of(swan, resolution="Full-Resolution"))
    assert sequence.boxes[1].tolist() == [8, 20, 10, 8]
    assert datasets.load(swan / "swan").boxes[1].tolist() == [4, 10, 5, 4]
    assert datasets.load(swan / "goose").boxes[1].tolist() == [8, 20, 10, 8]


@pytest.mark.parametrize(
    ("choice", "number", "name", "box"),
    [
        ("", 1, "pair", [4, 10, 5, 4]),
        (":object=1", 1, "pair", [4, 10, 5, 4]),
        (":object=2", 2, "pair:object=2", [30, 20, 3, 5]),
        (":object=3", 3, "pair:object=3", [40, 2, 4, 2]),
    ],
)
def test_an_object_is_chosen_by_its_number_and_void_is_none(pair, choice, number, name, box):
    for path in (pair / "pair", images_of(pair, "pair")):
        sequence = datasets.load(f"{path}{choice}")
        assert sequence.name == name
        assert sequence.boxes[1].tolist() == box
        np.testing.assert_array_equal(sequence.mask(1), several(1) == number)
        assert sequence.present.tolist() == [number != 3, True, True, True]


def test_which_objects_there_are_is_told(pair, swan):
    (told,) = datasets.options(str(pair / "pair"))
    assert told == {"name": "object", "default": 1, "meaning": "which object of 1, 2, 3"}
    assert datasets.options(f"{pair / 'pair'}:object=2") == [told]
    (alone,) = datasets.options(str(swan / "swan"))
    assert alone["meaning"] == "which object of 1"
    assert datasets.load(f"{swan / 'swan'}:object=1").name == "swan"


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        (":object=4", "pair: there is no object '4'. There are: 1, 2, 3."),
        (":object=255", "pair: there is no object '255'"),
        (":object=one", "pair: there is no object 'one'"),
        (":colour=2", "pair: unknown option 'colour'. Known: object."),
        (":object", "unknown sequence"),
    ],
)
def test_a_choice_that_there_is_not_is_refused_with_what_there_is(pair, choice, message):
    with pytest.raises(SequenceError) as caught:
        datasets.load(f"{pair / 'pair'}{choice}")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_other_formats_offer_no_choice(write_otb, tmp_path):
    folder = write_otb(tmp_path / "Dog", "1,1,5,5\n" * 3)
    assert datasets.options(str(folder)) == []
    with pytest.raises(SequenceError, match=r"Dog: unknown option 'object'. Known: none"):
        datasets.load(f"{folder}:object=2")


def test_masks_are_read_whatever_way_their_values_are_stored(write_davis):
    masks = [several(i) for i in range(2)]
    grey = datasets.load(write_davis(masks, "grey") / "grey")
    palette = datasets.load(write_davis(masks, "palette", save=write_palette) / "palette")
    for i in range(2):
        np.testing.assert_array_equal(grey.mask(i), palette.mask(i))
    two = [np.minimum(single(i), 1) for i in range(2)]

    def write_bits(file, mask):
        Image.fromarray(mask > 0).save(file)

    bits = datasets.load(write_davis(two, "bits", save=write_bits) / "bits")
    np.testing.assert_array_equal(bits.mask(1), single(1) > 0)


def changed(file, change):
    data = bytearray(file.read_bytes())
    file.write_bytes(change(data) or data)


def flip_a_bit(data):
    data[len(data) // 2] ^= 16


BROKEN = {
    "a mask is missing": (
        lambda images, masks: (masks / "00002.png").unlink(),
        "00002.png: there is no such mask; every image has one",
    ),
    "all masks are missing": (
        lambda images, masks: [file.unlink() for file in masks.iterdir()],
        "00000.png: there is no such mask",
    ),
    "a mask is too many": (
        lambda images, masks: write_grey(masks / "00004.png", single(4)),
        "00004.png: there is no image to this mask",
    ),
    "an image is missing": (
        lambda images, masks: (images / "00001.jpg").unlink(),
        "00001.jpg: there is no such image between 00000.jpg and 00002.jpg",
    ),
    "all images are missing": (
        lambda images, masks: [file.unlink() for file in images.iterdir()],
        "there are no images",
    ),
    "an image has no number": (
        lambda images, masks: (images / "00003.jpg").rename(images / "last.jpg"),
        "last.jpg: its name is no number",
    ),
    "a mask has another size": (
        lambda images, masks: write_grey(masks / "00002.png", blank((40, 32))),
        "00002.png: the mask has 40x32 pixels, the images have 48x32",
    ),
    "a mask has colours": (
        lambda images, masks: write_grey(masks / "00002.png", np.dstack([single(2)] * 3)),
        "00002.png: the mask is an image of colours",
    ),
    "a mask is damaged": (
        lambda images, masks: changed(masks / "00002.png", flip_a_bit),
        "00002.png: the mask can't be read",
    ),
    "a mask is cut short": (
        lambda images, masks: changed(masks / "00002.png", lambda data: data[:60]),
        "00002.png: the mask can't be read",
    ),
    "there is no object": (
        lambda images, masks: [write_grey(file, blank()) for file in masks.iterdir()],
        "all masks are empty",
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_is_wrong_is_told_in_a_line_with_the_file(swan, case):
    harm, message = BROKEN[case]
    harm(images_of(swan), masks_of(swan))
    with pytest.raises(SequenceError, match=rf"^[^\n]*480p/swan.*{message}[^\n]*$"):
        datasets.load(images_of(swan))


def test_without_a_folder_of_masks_it_is_a_folder_of_images(swan):
    for file in masks_of(swan).iterdir():
        file.unlink()
    masks_of(swan).rmdir()
    sequence = datasets.load(images_of(swan))
    assert len(sequence) == 4
    with pytest.raises(SequenceError, match="no ground truth"):
        sequence.check_runnable()


def test_the_fingerprint_follows_masks_and_the_object(pair):
    def fingerprint(choice=""):
        return datasets.load(f"{pair / 'pair'}{choice}").fingerprint

    before = fingerprint()
    assert fingerprint() == before != fingerprint(":object=2")
    mask = several(1)
    mask[12, 6] = 0  # the box stays
    write_palette(masks_of(pair, "pair") / "00001.png", mask)
    assert fingerprint() != before


@pytest.mark.parametrize(
    ("name", "frames"), [("libby", 49), ("blackswan", 50), ("drift-straight", 50)]
)
def test_real_sequences_open_as_published(recorded, name, frames):
    root = recorded / "davis"
    if not root.is_dir():
        pytest.skip("no sequences of DAVIS beside the checkout")
    sequence = datasets.load(root / name)
    assert (sequence.name, len(sequence)) == (name, frames)
    assert sequence[0].shape == (480, 854, 3)
    assert sequence.present.all()
    for frame in (0, frames // 2, frames - 1):
        x, y, width, height = sequence.boxes[frame].astype(int)
        mask = cv2.imread(str(masks_of(root, name) / f"{frame:05}.png"), cv2.IMREAD_GRAYSCALE)
        np.testing.assert_array_equal(sequence.mask(frame), mask == 255)
        rows, columns = np.nonzero(mask)
        assert (columns.min(), columns.max() + 1) == (x, x + width)
        assert (rows.min(), rows.max() + 1) == (y, y + height)
    sequence.check_runnable()
