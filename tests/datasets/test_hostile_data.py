"""Unusual and malicious data are rejected by an error that names the file."""

import os
import subprocess
import sys
import zlib

import cv2
import numpy as np
import pytest

from tests.datasets.readers import layouts
from trackmark import datasets
from trackmark.datasets import SequenceError, readers

BOX = "frame,x,y,width,height\n0,1,2,8,9\n"


def load_all(path, **options):
    sequence = datasets.load(path, **options)
    sequence.check_runnable()
    return [sequence[i] for i in range(len(sequence))], sequence.fingerprint


def otb(folder, write_images, truth, name="groundtruth_rect.txt", tags=b"IV"):
    write_images(folder / "img", ["0001.png", "0002.png"])
    (folder / name).write_text(truth)
    (folder / "attrs.txt").write_bytes(tags)
    return folder


def images(folder, write_images, row="1,1,2,3,4"):
    write_images(folder, ["1.png", "2.png"])
    (folder / "truth.csv").write_text(f"{BOX}{row}\n")
    return folder


def unread_truth(folder, write_images):
    write_images(folder, ["a.png", "b.png"])
    (folder / "groundtruth.txt").write_text("1,2,3,2,3,4,1,4\n")
    return folder


def no_target(folder, write_images):
    return otb(folder, write_images, "", "groundtruth_rect.1.txt")


def two_sizes(folder, write_images):
    images(folder, write_images)
    write_images(folder, ["2.png"], size=(20, 10))
    return folder


def large_bitmap(folder, write_images):
    write_images(folder, ["1.bmp"])
    data = bytearray((folder / "1.bmp").read_bytes())
    data[22:26] = (1 << 31).to_bytes(4, "little")
    (folder / "1.bmp").write_bytes(data)
    (folder / "truth.csv").write_text(BOX)
    return folder


def disguised_gif(folder, write_images):
    size = (65000).to_bytes(2, "little") + (15000).to_bytes(2, "little")
    screen, picture = b"GIF89a" + size + b"\x80\0\0" + bytes(6), b",\0\0\0\0" + size
    images(folder, write_images)
    (folder / "1.png").write_bytes(screen + picture + b"\0\x02\x02\x44\x01\0;")
    return folder


def latin_folder_name(folder, write_images):
    return images(folder, write_images).rename(folder.parent / os.fsdecode(b"caf\xe9"))


def latin_file_name(folder, write_images):
    images(folder, write_images)
    (folder / "1.png").rename(folder / os.fsdecode(b"\xe9.png"))
    return folder


def damaged_first_image(folder, write_images):
    path, _, frame = layouts.davis(folder, write_images, None, n=1)
    frame.write_bytes(b"\xff\xd8 truncated")
    return path


def chunk(kind, data):
    return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")


def truncated_palette(folder, write_images):
    path, mask, _ = layouts.davis(folder, write_images, None, n=1)
    data = mask.read_bytes()
    start = data.index(b"PLTE") - 4
    mask.write_bytes(data[:start] + b"\0\0\0\xff" + data[start + 4 :])
    return path


def huge_png():
    """Return a PNG file of 60000x60000 pixels in a few bytes."""
    header = (60000).to_bytes(4, "big") * 2 + b"\x08\x03\0\0\0"
    pixels = chunk(b"IDAT", zlib.compress(bytes(10_000)))
    palette = chunk(b"PLTE", bytes(6))
    start = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
    return start + palette + pixels + chunk(b"IEND", b"")


def decompression_bomb(folder, write_images):
    path, mask, _ = layouts.davis(folder, write_images, None, n=1)
    mask.write_bytes(huge_png())
    return path


def mask_of_huge_image(folder, write_images):
    folder.mkdir()
    (folder / "1.png").write_bytes(huge_png())
    (folder / "groundtruth.txt").write_text("m0,0,1,1,0,1\n")
    return folder


# Function that writes the data and returns the path to open, and the expected error.
HOSTILE = {
    "unread truth": (
        unread_truth,
        r"no ground truth.* The format of \S+groundtruth\.txt is not .* truth\.csv with",
    ),
    "no target": (
        no_target,
        r"no groundtruth_rect\.txt, and no groundtruth_rect\.1\.txt with rows\. Add",
    ),
    "attributes in Latin-1": (
        lambda f, w: otb(f, w, "1,2,3,4\n" * 2, tags=b"d\xe9formation"),
        r"attrs\.txt: not a text file in UTF-8",
    ),
    "far OTB box": (
        lambda f, w: otb(f, w, "1,2,3,4\n1,2,1e300,4\n"),
        r"groundtruth_rect\.txt: the box of 0002\.png, .*1e\+300",
    ),
    "far box": (
        lambda f, w: images(f, w, "1,-1e300,2,3,4"),
        r"truth\.csv: the box of 2\.png, -1e\+300",
    ),
    "long cell": (
        lambda f, w: images(f, w, f"1,{'a' * 500_000},2,3,4"),
        r"truth\.csv: line 3: 'a+\.\.\.a+' is not a number",
    ),
    "long row": (
        lambda f, w: otb(f, w, "7 " * 100_000),
        r"groundtruth_rect\.txt: line 1: '7 .*\.\.\.",
    ),
    "long number": (
        lambda f, w: images(f, w, f"{'9' * 5000},1,2,3,4"),
        r"truth\.csv: line 3: '9+\.\.\.9+' is not a frame number",
    ),
    "two sizes": (two_sizes, r"walk: 2\.png has 20x10 pixels, other images have 48x32"),
    "large bitmap": (large_bitmap, r"1\.bmp: frame 0 cannot be read"),
    "GIF named PNG": (
        disguised_gif,
        r"1\.png: frame 0 cannot be read \(not an image in the format JPEG, PNG",
    ),
    "folder in Latin-1": (latin_folder_name, r"caf\\udce9: this name is not UTF-8"),
    "file in Latin-1": (latin_file_name, r"\\udce9\.png: this name is not UTF-8"),
    "damaged image": (damaged_first_image, r"00000\.jpg: damaged, or not an image"),
    "truncated palette": (truncated_palette, r"00000\.png: the mask cannot be read"),
    "mask of a huge image": (
        mask_of_huge_image,
        r"groundtruth\.txt: line 1: its header states 60000x60000",
    ),
    "decompression bomb": (
        decompression_bomb,
        r"00000\.png: the mask cannot be read \(its header states 60000x60000",
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_data_are_rejected_by_file(case, tmp_path, write_images):
    make, message = HOSTILE[case]
    path = make(tmp_path / "walk", write_images)
    with pytest.raises(SequenceError, match=message) as error:
        load_all(path)
    assert len(str(error.value)) < 900
    assert "\n" not in str(error.value)
    str(error.value).encode()  # logs and terminals need UTF-8


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a" * 5000, "File name too long"),
        ("x/" * 2500, "File name too long"),
        (f"samples/face:{'a' * 5000}=1", "unknown option"),
        ("~nobody-of-this-name/clip.mp4", "home directory"),
        ("samples/\udce9", "not UTF-8"),
        ("circle", "circle|loop"),
    ],
)
def test_invalid_path_is_refused(text, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "circle").symlink_to("circle")
    with pytest.raises(SequenceError, match=message) as error:
        datasets.load(text)
    assert len(str(error.value)) < 900
    with pytest.raises(SequenceError, match=r"cannot be read \(File name too long\)"):
        readers.path_format(tmp_path / ("a" * 300))


def test_given_ground_truth_opens_a_folder_without_targets(tmp_path, write_images):
    path = no_target(tmp_path / "walk", write_images)
    (tmp_path / "mine.csv").write_text(BOX)
    assert len(load_all(path, truth=tmp_path / "mine.csv")[0]) == 2


def test_unread_file_next_to_a_video_is_named(tmp_path, write_video):
    video = write_video(tmp_path / "cup.mp4", n=3)
    (tmp_path / "cup.txt").write_text("1 2 3 4\n")
    with pytest.raises(SequenceError, match=r"The format of \S+cup\.txt is not .* cup\.csv with"):
        load_all(video)


def test_video_frame_of_another_size_is_refused(tmp_path, write_video):
    first, second = (
        write_video(tmp_path / f"{n}.mpg", "mpeg2video", n=n, size=size, b_frames=0)
        for n, size in ((5, (96, 64)), (4, (48, 32)))
    )
    (tmp_path / "both.mpg").write_bytes(first.read_bytes() + second.read_bytes())
    (tmp_path / "both.csv").write_text(f"{BOX}7,1,2,8,9\n")
    match = r"both\.mpg: frame [45] has 48x32 pixels, other images have 96"
    with pytest.raises(SequenceError, match=match):
        load_all(tmp_path / "both.mpg")


# VmHWM counts the memory since the start of the program; ru_maxrss is inherited from the parent.
READ_ALL = """
import re, sys
from trackmark import datasets
sequence = datasets.load(sys.argv[1])
for frame in range(len(sequence)):
    sequence[frame], sequence.mask(frame), sequence.shapes and sequence.shapes[frame]
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["images", "davis", "vot"])
def test_largest_accepted_images_need_less_than_1_gib(kind, tmp_path, write_images):
    """Read uniform images of 10^8 pixels in another process."""
    path, side = tmp_path / "walk", 10_000
    if kind == "davis":
        path, mask, frame = layouts.davis(path, write_images, None, n=1)
        assert cv2.imwrite(str(mask), np.eye(side, dtype=np.uint8))
        assert cv2.imwrite(str(frame), np.zeros((side, side), np.uint8))
    else:
        write_images(path, ["1.png"])
        assert cv2.imwrite(str(path / "1.png"), np.zeros((side, side), np.uint8))
        (path / "truth.csv").write_text(BOX)
    if kind == "vot":
        (path / "truth.csv").unlink()
        (path / "groundtruth.txt").write_text(f"m0,0,{side},{side},5,{side * side - 5}\n")
    assert sum(file.stat().st_size for file in tmp_path.rglob("*") if file.is_file()) < 2e6
    run = subprocess.run(
        [sys.executable, "-c", READ_ALL, str(path)], capture_output=True, text=True, check=True
    )
    assert int(run.stdout) * 1024 < 2**30
