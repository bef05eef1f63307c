"""Copies that aren't whole: each frame with its own row of the truth, or an error that names it."""

import shutil
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.datasets.readers import plain_readings
from tests.datasets.readers.test_mutations import READERS
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.image_files import SUFFIXES

EVERYDAY, ALL = 40, 1000

# Numbers of the images that the truth begins with, where it goes by numbers.
FIRSTS = {"trackingnet": 0, "tcolor128": 4, "images": None, "davis": None, "mp4": None, "avi": None}


def entries(data, *, folders):
    return sorted(path for path in data.rglob("*") if path.is_dir() == folders)


def images(data):
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
    files = images(data)
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
    [range(EVERYDAY), pytest.param(range(EVERYDAY, ALL), marks=pytest.mark.weekly)],
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
