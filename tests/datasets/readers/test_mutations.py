"""Damaged files and incomplete copies of datasets.

A damaged file or copy is refused by an error that names the file, or it is read, and an independent
reader returns the same boxes. Any other exception is a failure.
"""

import resource
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.datasets.readers import plain_readings
from tests.datasets.readers.layouts import LAYOUTS, Recording
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.image_files import SUFFIXES
from trackmark.datasets.interface import MAX_COORDINATE

N_DAMAGED_FILES = {"everyday": 25, "weekly": 10_000}
N_COPIES = {"everyday": 20, "weekly": 1000}
STRAY = [
    *(b"\0", b"\xff", b"\xe9", b"-", b"9", b"1e300", b"nan", b",", b"\n", b"\r", b'"'),
    b"\xc2\xb2",  # superscript two: a digit for Python
]

FIRST_NUMBERS = {"trackingnet": 0, "tcolor128": 4} | dict.fromkeys(
    ("images", "davis", "video", "avi")
)
"""Number in the name of the first annotated image: None without numbers, 1 in other layouts."""


def avi(folder, write_images, write_video):
    folder.mkdir(parents=True)
    file = write_video(folder / "walk.avi", "mpeg4", n=4, b_frames=1)
    return Recording(file, None, file)


@pytest.fixture(params=[*LAYOUTS, avi], ids=lambda layout: layout.__name__)
def damageable(request, tmp_path, write_images, write_video):
    """Layout, folder of the data, path to open, and function that returns the expected boxes."""
    data, layout = tmp_path / "data", request.param
    plain = getattr(plain_readings, layout.__name__)
    path = layout(data, write_images, write_video).path
    return layout, data, path, lambda n: [box or [np.nan] * 4 for box in plain(data, n)]


def parametrize_numbers(counts):
    """Parametrize a test with seeds: the first seeds every day, the further seeds every week."""
    weekly = range(counts["everyday"], counts["weekly"])
    seeds = [range(counts["everyday"]), pytest.param(weekly, marks=pytest.mark.weekly)]
    return pytest.mark.parametrize("numbers", seeds, ids=["everyday", "all"])


def generator(layout, number):
    return np.random.default_rng([[*LAYOUTS, avi].index(layout), number])


def mutate(data, random):
    """Return the bytes with one to three random changes."""
    data = bytearray(data)
    for _ in range(random.integers(1, 4)):
        # Half of the changes are in the first 80 bytes, which contain sizes and counts.
        end = len(data) + 1 if random.random() < 0.5 else 80
        offset = int(random.integers(0, end) % (len(data) + 1))
        kind = random.integers(0, 7)
        if kind == 0:
            data[offset : offset + 1] = bytes([random.integers(0, 256)])
        elif kind == 1 and offset < len(data):
            data[offset] ^= 1 << int(random.integers(0, 8))
        elif kind == 2:
            del data[offset:]
        elif kind == 3:
            data[offset:offset] = STRAY[random.integers(0, len(STRAY))]
        elif kind == 4:
            del data[offset : offset + int(random.integers(1, 9))]
        elif kind == 5:
            data[offset : offset + 4] = bytes(random.choice([0, 127, 255], 4).tolist())
        else:
            source = int(random.integers(0, len(data) + 1))
            data[offset : offset + 8] = data[source : source + 8]
    return bytes(data)


def read_all(path, expected_boxes):
    """Read images, masks and ground truth, check them, and return the ground truth as bytes."""
    sequence = datasets.load(path)
    assert sequence.fingerprint
    datasets.options(str(path))
    boxes = sequence.boxes[sequence.present]
    assert np.isfinite(boxes).all()
    assert (np.abs(boxes) <= MAX_COORDINATE).all()
    expected = np.reshape(expected_boxes(len(sequence) + sequence.n_unread_images), (-1, 4))
    if len(expected) == 1:  # only the first frame is annotated
        expected = np.pad(expected, ((0, len(sequence) - 1), (0, 0)), constant_values=np.nan)
    np.testing.assert_allclose(sequence.boxes, expected, rtol=1e-12, atol=1e-9)
    if sequence.present.any():
        sequence.check_runnable()
    shapes = set()
    for i in range(len(sequence)):
        image, mask = sequence[i], sequence.mask(i)
        assert image.dtype == np.uint8
        assert mask is None or mask.shape == image.shape[:2]
        shapes.add(image.shape)
    assert len(shapes) == 1
    assert len(shapes.pop()) == 3
    return sequence.boxes.tobytes(), sequence.visibility.tobytes(), *sequence.attributes


def check_message(error, names, number, max_length=2000):
    """Check that an error is one line that contains one of the names."""
    message = str(error)
    assert len(message) < max_length, (number, message)
    assert any(name in message for name in names), (number, message)
    assert "\n" not in message, (number, message)


@parametrize_numbers(N_DAMAGED_FILES)
def test_damaged_file_is_refused_or_read_correctly(damageable, numbers, evidence):
    layout, data, path, expected_boxes = damageable
    files = sorted(file for file in data.rglob("*") if file.is_file())
    contents = {file: file.read_bytes() for file in files}
    before = read_all(path, expected_boxes)
    outcomes = Counter()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in numbers:
        file = files[number % len(files)]
        file.write_bytes(mutate(contents[file], generator(layout, number)))
        try:
            same = read_all(path, expected_boxes) == before
            outcomes["equal" if same else "read with other numbers"] += 1
        except SequenceError as error:
            outcomes["refused"] += 1
            check_message(error, [file.name, str(data)], number, 1000)
        except BaseException as error:
            error.add_note(f"mutation {number} of {layout.__name__}, of {file.name}")
            raise
        finally:
            file.write_bytes(contents[file])
    assert 0 < outcomes["refused"] < len(numbers)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory) / 2**20  # KiB to GiB
    assert grown < 1
    counts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()))
    evidence(f"{layout.__name__}, {len(numbers)} mutations: {counts}; {grown:.2f} GiB more")


def entries(data, *, folders):
    return sorted(path for path in data.rglob("*") if path.is_dir() == folders)


def other_name(path, random):
    """Return a path with a similar name: the next number, another spelling or another suffix."""
    stem = path.stem
    names = [f"{stem}-copy", f"_{stem}"]
    if stem.isdecimal():
        names += [f"{abs(int(stem) + step):0{len(stem)}}" for step in (-1, 1, 3)]
    return path.with_name(random.choice(names) + random.choice([path.suffix, ".bak", ".png"]))


def select(paths, random):
    return paths[random.integers(0, len(paths))]


def remove_file(data, random):
    select(entries(data, folders=False), random).unlink()


def remove_folder(data, random):
    shutil.rmtree(select(entries(data, folders=True) or [data], random))


def remove_image(data, random):
    """Remove the first image, one in the middle, or the last one."""
    files = [file for file in entries(data, folders=False) if file.suffix in SUFFIXES]
    if files:
        files[[0, len(files) // 2, -1][random.integers(0, 3)]].unlink()


def rename(data, random):
    paths = entries(data, folders=bool(random.random() < 0.3))
    if paths:
        path = select(paths, random)
        path.rename(other_name(path, random))


def copy(data, random):
    path = select(entries(data, folders=False), random)
    shutil.copy(path, other_name(path, random).with_suffix(path.suffix))


def swap(data, random):
    """Exchange the names of two files or folders."""
    paths = entries(data, folders=bool(random.random() < 0.3))
    if not paths:
        return
    first, second = select(paths, random), select(paths, random)
    if first not in (second, *second.parents) and second not in first.parents:
        spare = data / "spare"
        first.rename(spare)
        second.rename(first)
        spare.rename(second)


def change_rows(data, random):
    """Remove or repeat a row of a text file."""
    texts = [file for file in entries(data, folders=False) if file.suffix in (".txt", ".csv")]
    if texts:
        file = select(texts, random)
        lines = file.read_bytes().splitlines(keepends=True)
        index = int(random.integers(0, len(lines) + 1))
        lines[index : index + 1] = lines[index : index + 1] * random.choice([0, 2])
        file.write_bytes(b"".join(lines))


CHANGES = [remove_file, remove_folder, remove_image, rename, copy, swap, change_rows]


def check_frames(path, expected_boxes, first_number):
    """Check each frame's box against the row of its image number, and return the outcome."""
    sequence = datasets.load(path)
    if not sequence.present.any():
        with pytest.raises(SequenceError):
            sequence.check_runnable()
        return "without ground truth"
    expected = expected_boxes(len(sequence) + sequence.n_unread_images)
    for frame, box in enumerate(sequence.boxes):
        row = frame
        if first_number is not None:
            row = int(Path(sequence.frame_name(frame)).stem) - first_number
        assert row >= 0
        np.testing.assert_allclose(box, expected[row], atol=1e-9)
    return "correct"


@parametrize_numbers(N_COPIES)
def test_incomplete_copy_is_refused_or_read_correctly(damageable, numbers, tmp_path, evidence):
    layout, data, path, expected_boxes = damageable
    complete = tmp_path / "complete"
    first_number = FIRST_NUMBERS.get(layout.__name__, 1)
    shutil.copytree(data, complete)
    check_frames(path, expected_boxes, first_number)
    outcomes = Counter()
    for number in numbers:
        random = generator(layout, number)
        changes = random.choice(CHANGES, random.integers(1, 3))
        try:
            for change in changes:
                if data.exists() and entries(data, folders=False):
                    change(data, random)
            outcomes[check_frames(path, expected_boxes, first_number)] += 1
        except SequenceError as error:
            outcomes["refused"] += 1
            names = {file.name for root in (data, complete) for file in root.rglob("*")}
            check_message(error, names, number)
        except BaseException as error:
            error.add_note(f"mutation {number} of {layout.__name__}: {changes}")
            raise
        finally:
            shutil.rmtree(data, ignore_errors=True)
            shutil.copytree(complete, data)
    assert outcomes["refused"]
    counts = ", ".join(f"{count} {outcome}" for outcome, count in sorted(outcomes.items()))
    evidence(f"{layout.__name__}, {len(numbers)} copies: {counts}")
