"""Damaged files and copies that are not whole.

Each is read as it stands, each frame with its own row of the truth, or refused by an error that
names the file; there is never another traceback.
"""

import resource
import shutil
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.datasets.readers import plain_readings
from tests.datasets.readers.layouts import LAYOUTS
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.image_files import SUFFIXES

EVERYDAY, ALL, LARGEST = 50, 10_000, 1e7
BOXES = "frame,x,y,width,height,visibility,source\n0,1,2,8,9,0.5,marked\n1,2,2,8,9,,\n2,,,,,,\n"
STRAY = [
    b"\0",
    b"\xff",
    b"\xe9",
    b"-",
    b"9",
    b"1e300",
    b"nan",
    b",",
    b"\n",
    b"\r",
    b'"',
    b"\xc2\xb2",
]


def images(folder, write_images, write_video):
    write_images(folder, ["1.png", "2.jpg", "3.bmp", "4.tif", "5.ppm"], size=(24, 16))
    (folder / "truth.csv").write_text(BOXES)
    return folder


def otb(folder, write_images, write_video):
    write_images(folder / "img", ["0001.png", "0002.jpg", "0003.png"], size=(24, 16))
    (folder / "groundtruth_rect.txt").write_text("2,3,8,9\n3\t3\t8\t9\n4 3 8 9\n")
    (folder / "attrs.txt").write_text("OCC, SV\n")
    return folder


def davis(folder, write_images, write_video):
    shown, masks = (folder / kind / "480p" / "walk" for kind in ("JPEGImages", "Annotations"))
    write_images(shown, ["00000.jpg", "00001.jpg"], size=(24, 16))
    masks.mkdir(parents=True)
    from PIL import Image

    for i in range(2):
        mask = np.zeros((16, 24), np.uint8)
        mask[4:9, 3 + i : 8 + i] = 1
        image = Image.fromarray(mask, "P")
        image.putpalette([0, 0, 0, 128, 0, 0])
        image.save(masks / f"{i:05}.png")
    return shown


def mp4(folder, write_images, write_video):
    folder.mkdir(parents=True)
    (folder / "walk.csv").write_text(BOXES)
    return write_video(folder / "walk.mp4", n=3, b_frames=0)


def avi(folder, write_images, write_video):
    folder.mkdir(parents=True)
    return write_video(folder / "walk.avi", "mpeg4", n=4, b_frames=1)


def small(layout):
    def make(folder, write_images, write_video):
        return layout(folder.parent, write_images, write_video, size=(24, 16))[0]

    make.__name__ = layout.__name__
    return make


READERS = [images, otb, davis, mp4, avi, *map(small, LAYOUTS)]


def mutated(data, random):
    """The bytes with one to three things wrong."""
    data = bytearray(data)
    for _ in range(random.integers(1, 4)):
        # Half of the hits are in the head, where sizes and counts stand.
        at = int(
            random.integers(0, len(data) + 1 if random.random() < 0.5 else 80) % (len(data) + 1)
        )
        kind = random.integers(0, 7)
        if kind == 0:
            data[at : at + 1] = bytes([random.integers(0, 256)])
        elif kind == 1 and at < len(data):
            data[at] ^= 1 << int(random.integers(0, 8))
        elif kind == 2:
            del data[at:]
        elif kind == 3:
            data[at:at] = STRAY[random.integers(0, len(STRAY))]
        elif kind == 4:
            del data[at : at + int(random.integers(1, 9))]
        elif kind == 5:
            data[at : at + 4] = bytes(random.choice([0, 127, 255], 4).tolist())
        else:
            other = int(random.integers(0, len(data) + 1))
            data[at : at + 8] = data[other : other + 8]
    return bytes(data)


def check_all(path, plain):
    """Read everything there is of a sequence; what is told must be so, and well-formed.

    `plain`: gives the boxes of so many images. Returns what was told of the target.
    """
    sequence = datasets.load(path)
    assert sequence.fingerprint
    datasets.options(str(path))
    boxes = sequence.boxes[sequence.present]
    assert np.isfinite(boxes).all()
    assert (np.abs(boxes) <= LARGEST).all()
    said = plain(len(sequence) + sequence.images_beyond_truth)
    absent = [np.nan] * 4
    said = [absent if box is None else box for box in said]
    np.testing.assert_allclose(sequence.boxes, np.reshape(said, (-1, 4)), rtol=1e-12, atol=1e-9)
    if sequence.present.any():
        sequence.check_runnable()
    shapes = set()
    for i in range(len(sequence)):
        image = sequence[i]
        assert image.dtype == np.uint8
        shapes.add(image.shape)
        mask = sequence.mask(i)
        assert mask is None or mask.shape == image.shape[:2]
    assert len(shapes) == 1
    assert len(shapes.pop()) == 3
    return sequence.boxes.tobytes(), sequence.visibility.tobytes(), *sequence.attributes


@pytest.mark.parametrize("make", READERS, ids=lambda make: make.__name__)
@pytest.mark.parametrize(
    "numbers",
    [range(EVERYDAY), pytest.param(range(EVERYDAY, ALL), marks=pytest.mark.weekly)],
    ids=["everyday", "all"],
)
def test_damaged_files_are_told_in_their_name_or_read_as_they_stand(
    make, numbers, tmp_path, write_images, write_video, evidence
):
    walk = tmp_path / "data" / "walk"
    path = make(walk, write_images, write_video)
    plain = partial(getattr(plain_readings, make.__name__), walk)
    files = sorted(file for file in (tmp_path / "data").rglob("*") if file.is_file())
    whole = {file: file.read_bytes() for file in files}
    before = check_all(path, plain)
    outcomes = Counter()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in numbers:
        random = np.random.default_rng([READERS.index(make), number])
        file = files[number % len(files)]
        file.write_bytes(mutated(whole[file], random))
        try:
            same = check_all(path, plain) == before
            outcomes["the same" if same else "other numbers, as they stand"] += 1
        except SequenceError as error:
            outcomes["refused"] += 1
            said = str(error)
            assert file.name in said or str(tmp_path / "data") in said, (number, said)
            assert len(said) < 1000, (number, said)
            assert "\n" not in said, (number, said)
        except BaseException as error:
            error.add_note(f"mutation {number} of {make.__name__}, of {file.name}")
            raise
        finally:
            file.write_bytes(whole[file])
    assert 0 < outcomes["refused"] < len(numbers)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory) / 2**20  # of KiB
    assert grown < 1, "GiB"
    counts = ", ".join(f"{count} {what}" for what, count in sorted(outcomes.items()))
    evidence(f"{make.__name__}, {len(numbers)} mutations: {counts}; at most {grown:.2f} GiB more")


COPIES, ALL_COPIES = 40, 1000

# Numbers of the images that the truth begins with, where it goes by numbers.
FIRSTS = {"trackingnet": 0, "tcolor128": 4, "images": None, "davis": None, "mp4": None, "avi": None}


def entries(data, *, folders):
    return sorted(path for path in data.rglob("*") if path.is_dir() == folders)


def images_in(data):
    return [file for file in entries(data, folders=False) if file.suffix in SUFFIXES]


def otherwise_called(path, random):
    """A name that something else might have: the next number, another spelling, another kind."""
    stem = path.stem
    names = [f"{stem}-copy", f"_{stem}"]
    if stem.isdecimal():
        names += [f"{abs(int(stem) + step):0{len(stem)}}" for step in (-1, 1, 3)]
    return path.with_name(random.choice(names) + random.choice([path.suffix, ".bak", ".png"]))


def one_of(paths, random):
    return paths[random.integers(0, len(paths))]


def without_file(data, random):
    one_of(entries(data, folders=False), random).unlink()


def without_folder(data, random):
    shutil.rmtree(one_of(entries(data, folders=True), random))


def without_image(data, random):
    """At the beginning, between others, or at the end."""
    files = images_in(data)
    if files:
        files[[0, len(files) // 2, -1][random.integers(0, 3)]].unlink()


def renamed(data, random):
    path = one_of(entries(data, folders=bool(random.random() < 0.3)), random)
    path.rename(otherwise_called(path, random))


def doubled(data, random):
    path = one_of(entries(data, folders=False), random)
    shutil.copy(path, otherwise_called(path, random).with_suffix(path.suffix))


def swapped(data, random):
    """Two files or folders under each other's names."""
    paths = entries(data, folders=bool(random.random() < 0.3))
    one, other = one_of(paths, random), one_of(paths, random)
    if one not in (other, *other.parents) and other not in one.parents:
        aside = data / "aside"
        one.rename(aside)
        other.rename(one)
        aside.rename(other)


def other_rows(data, random):
    """A row of a text less or more."""
    texts = [file for file in entries(data, folders=False) if file.suffix in (".txt", ".csv")]
    if texts:
        file = one_of(texts, random)
        lines = file.read_bytes().splitlines(keepends=True)
        at = int(random.integers(0, len(lines) + 1))
        lines[at : at + 1] = lines[at : at + 1] * random.choice([0, 2])
        file.write_bytes(b"".join(lines))


KINDS = [without_file, without_folder, without_image, renamed, doubled, swapped, other_rows]


def check_frames(path, plain, first):
    """Each frame's box is what the truth that lies there says of its image; gives how many."""
    sequence = datasets.load(path)
    if not sequence.present.any():
        with pytest.raises(SequenceError):
            sequence.check_runnable()
        return "without truth"
    said = plain(len(sequence) + sequence.images_beyond_truth)
    for frame, box in enumerate(sequence.boxes):
        number = frame if first is None else int(Path(sequence.frame_name(frame)).stem) - first
        assert number >= 0
        expected = said[number]
        np.testing.assert_allclose(box, [np.nan] * 4 if expected is None else expected, atol=1e-9)
    return "right"


@pytest.mark.parametrize("make", READERS, ids=lambda make: make.__name__)
@pytest.mark.parametrize(
    "numbers",
    [range(COPIES), pytest.param(range(COPIES, ALL_COPIES), marks=pytest.mark.weekly)],
    ids=["everyday", "all"],
)
def test_a_copy_that_is_not_whole_is_told_or_read_as_it_stands(
    make, numbers, tmp_path, write_images, write_video, evidence
):
    data, whole = tmp_path / "data", tmp_path / "whole"
    path = make(data / "walk", write_images, write_video)
    plain = partial(getattr(plain_readings, make.__name__), data / "walk")
    first = FIRSTS.get(make.__name__, 1)
    shutil.copytree(data, whole)
    check_frames(path, plain, first)
    outcomes = Counter()
    for number in numbers:
        random = np.random.default_rng([READERS.index(make), number])
        kinds = random.choice(KINDS, random.integers(1, 3))
        try:
            for kind in kinds:
                if entries(data, folders=False):
                    kind(data, random)
            outcomes[check_frames(path, plain, first)] += 1
        except SequenceError as error:
            outcomes["refused"] += 1
            said = str(error)
            names = {file.name for root in (data, whole) for file in root.rglob("*")}
            assert any(name in said for name in names), (number, said)
            assert "\n" not in said, (number, said)
        except BaseException as error:
            error.add_note(f"mutation {number} of {make.__name__}: {kinds}")
            raise
        finally:
            shutil.rmtree(data)
            shutil.copytree(whole, data)
    assert outcomes["refused"]
    counts = ", ".join(f"{count} {what}" for what, count in sorted(outcomes.items()))
    evidence(f"{make.__name__}, {len(numbers)} copies: {counts}")
