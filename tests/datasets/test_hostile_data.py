"""Data as a hostile world has them: a line that names the culprit, never a traceback."""

import os
import subprocess
import sys
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image

from trackmark import datasets
from trackmark.datasets import SequenceError, readers

BOX = "frame,x,y,width,height\n0,1,2,8,9\n"


def load_all(path, **options):
    sequence = datasets.load(path, **options)
    sequence.check_runnable()
    return [sequence[i] for i in range(len(sequence))], sequence.fingerprint


def no_truth(folder, write_images):
    write_images(folder, ["a.png", "b.png"])
    (folder / "groundtruth.txt").write_text("1,2,3,2,3,4,1,4\n")
    return folder


def no_target(folder, write_images):
    write_images(folder / "img", ["0001.png"])
    (folder / "groundtruth_rect.1.txt").write_text("")
    return folder


def attributes(folder, write_images):
    write_images(folder / "img", ["0001.png"])
    (folder / "groundtruth_rect.txt").write_text("1,2,3,4\n")
    (folder / "attrs.txt").write_bytes("déformation".encode("latin-1"))
    return folder


def far_otb(folder, write_images):
    write_images(folder / "img", ["0001.png", "0002.png"])
    (folder / "groundtruth_rect.txt").write_text("1,2,3,4\n1,2,1e300,4\n")
    return folder


def far_csv(folder, write_images):
    write_images(folder, ["1.png", "2.png"])
    (folder / "truth.csv").write_text(f"{BOX}1,-1e300,2,3,4\n")
    return folder


def long_cell(folder, write_images):
    write_images(folder, ["1.png", "2.png"])
    (folder / "truth.csv").write_text(f"{BOX}1,{'a' * 5_000_000},2,3,4\n")
    return folder


def long_row(folder, write_images):
    write_images(folder / "img", ["0001.png"])
    (folder / "groundtruth_rect.txt").write_text("7 " * 2_500_000)
    return folder


def long_number(folder, write_images):
    write_images(folder, ["1.png", "2.png"])
    (folder / "truth.csv").write_text(f"{BOX}{'9' * 5000},1,2,3,4\n")
    return folder


def two_sizes(folder, write_images):
    write_images(folder, ["1.png", "2.png", "3.png"])
    write_images(folder, ["2.png"], size=(20, 10))
    (folder / "truth.csv").write_text(f"{BOX}2,1,2,8,9\n")
    return folder


def bitmap_head(folder, write_images):
    write_images(folder, ["1.bmp"])
    data = bytearray((folder / "1.bmp").read_bytes())
    data[22:26] = (1 << 31).to_bytes(4, "little")
    (folder / "1.bmp").write_bytes(data)
    (folder / "truth.csv").write_text(BOX)
    return folder


def disguised(folder, write_images):
    write_images(folder, ["1.png"])
    size = (65000).to_bytes(2, "little") + (15000).to_bytes(2, "little")
    screen, picture = b"GIF89a" + size + b"\x80\0\0" + bytes(6), b",\0\0\0\0" + size
    (folder / "1.png").write_bytes(screen + picture + b"\0\x02\x02\x44\x01\0;")
    (folder / "truth.csv").write_text(BOX)
    return folder


def no_text_in_a_name(folder, write_images):
    other = folder.parent / os.fsdecode(b"caf\xe9")
    write_images(folder, ["1.png"])
    (folder / "truth.csv").write_text(BOX)
    return folder.rename(other)


def no_text_in_a_file_name(folder, write_images):
    write_images(folder, ["1.png"])
    (folder / "1.png").rename(folder / os.fsdecode(b"\xe9.png"))
    return folder


def davis(folder, write_images):
    shown, masks = (folder / kind / "480p" / "walk" for kind in ("JPEGImages", "Annotations"))
    write_images(shown, ["00000.jpg"])
    masks.mkdir(parents=True)
    mask = Image.fromarray(np.eye(32, 48, dtype=np.uint8), "P")
    mask.putpalette([0, 0, 0, 128, 0, 0])
    mask.save(masks / "00000.png")
    return shown, masks / "00000.png"


def damaged_first_image(folder, write_images):
    shown, _ = davis(folder, write_images)
    (shown / "00000.jpg").write_bytes(b"\xff\xd8 and no more")
    return shown


def chunk(kind, data):
    return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")


def truncated_palette(folder, write_images):
    shown, mask = davis(folder, write_images)
    data = mask.read_bytes()
    at = data.index(b"PLTE") - 4
    mask.write_bytes(data[:at] + b"\0\0\0\xff" + data[at + 4 :])
    return shown


def bomb(folder, write_images):
    shown, mask = davis(folder, write_images)
    head = (60000).to_bytes(4, "big") * 2 + b"\x08\x03\0\0\0"
    pixels = chunk(b"IDAT", zlib.compress(bytes(10_000)))
    palette = chunk(b"PLTE", bytes(6))
    start = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)
    mask.write_bytes(start + palette + pixels + chunk(b"IEND", b""))
    return shown


HOSTILE = {
    no_truth: r"no ground truth.* \S+groundtruth\.txt is of a format .* truth\.csv with frame,x",
    no_target: r"no groundtruth_rect\.txt, nor a groundtruth_rect\.1\.txt with rows\. Copy",
    attributes: r"attrs\.txt: this is no text in UTF-8",
    far_otb: r"groundtruth_rect\.txt: the box of 0002\.png, .*1e\+300",
    far_csv: r"truth\.csv: the box of 2\.png, -1e\+300",
    long_cell: r"truth\.csv: line 3: 'a+\.\.\.a+' is not a number",
    long_row: r"groundtruth_rect\.txt: line 1: '7 .*\.\.\.",
    long_number: r"truth\.csv: line 3: '9+\.\.\.9+' is not a frame number",
    two_sizes: r"walk: 2\.png has 20x10 pixels, others have 48x32",
    bitmap_head: r"1\.bmp: frame 0 can't be read",
    disguised: r"1\.png: frame 0 can't be read \(not an image of JPEG, PNG",
    no_text_in_a_name: r"caf\\udce9: this name is not UTF-8",
    no_text_in_a_file_name: r"\\udce9\.png: this name is not UTF-8",
    damaged_first_image: r"00000\.jpg: this is no image, or damaged",
    truncated_palette: r"00000\.png: the mask can't be read",
    bomb: r"00000\.png: the mask can't be read \(it claims 60000x60000 pixels",
}


@pytest.mark.parametrize("make", HOSTILE, ids=lambda make: make.__name__)
def test_a_line_names_the_culprit(make, tmp_path, write_images):
    path = make(tmp_path / "walk", write_images)
    with pytest.raises(SequenceError, match=HOSTILE[make]) as caught:
        load_all(path)
    assert len(str(caught.value)) < 900
    assert "\n" not in str(caught.value)
    str(caught.value).encode()  # a log and a terminal can hold it


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a" * 5000, "File name too long"),
        ("x/" * 2500, "File name too long"),
        (f"samples/face:{'a' * 5000}=1", "takes no options"),
        ("~nobody-of-this-name/clip.mp4", "home directory"),
        ("samples/\udce9", "not UTF-8"),
        ("circle", "circle|loop"),
    ],
)
def test_paths_that_lead_nowhere_are_a_line(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "circle").symlink_to("circle")
    with pytest.raises(SequenceError, match=words) as caught:
        datasets.load(text)
    assert len(str(caught.value)) < 900


def test_a_truth_that_is_given_wins_over_one_of_several_targets(tmp_path, write_images):
    path = no_target(tmp_path / "walk", write_images)
    (tmp_path / "mine.csv").write_text(BOX)
    assert len(load_all(path, truth=tmp_path / "mine.csv")[0]) == 1


def test_a_file_beside_a_video_that_looks_like_its_truth_is_named(tmp_path, write_video):
    video = write_video(tmp_path / "cup.mp4", n=3)
    (tmp_path / "cup.txt").write_text("1 2 3 4\n")
    with pytest.raises(SequenceError, match=r"\S+cup\.txt is of a format .* cup\.csv with"):
        load_all(video)


def test_a_frame_of_another_size_in_a_video_is_named(tmp_path, write_video):
    whole, other = (
        write_video(tmp_path / f"{n}.mpg", "mpeg2video", n=n, size=size, b_frames=0)
        for n, size in ((5, (96, 64)), (4, (48, 32)))
    )
    (tmp_path / "both.mpg").write_bytes(whole.read_bytes() + other.read_bytes())
    (tmp_path / "both.csv").write_text(f"{BOX}7,1,2,8,9\n")
    with pytest.raises(
        SequenceError, match=r"both\.mpg: frame [45] has 48x32 pixels, others have 96"
    ):
        load_all(tmp_path / "both.mpg")


LOOK = """
import resource, sys
from trackmark import datasets
sequence = datasets.load(sys.argv[1])
for frame in range(len(sequence)):
    sequence[frame], sequence.mask(frame), sequence.shapes and sequence.shapes[frame]
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["images", "davis", "vot"])
def test_the_largest_images_that_are_read_take_less_than_a_gigabyte(kind, tmp_path, write_images):
    """Of 10^8 pixels, all alike, so that the files are small."""
    path, side = tmp_path / "walk", 10_000
    if kind == "davis":
        path, mask = davis(path, write_images)
        assert cv2.imwrite(str(mask), np.eye(side, dtype=np.uint8))
        assert cv2.imwrite(str(path / "00000.jpg"), np.zeros((side, side), np.uint8))
    else:
        write_images(path, ["1.png"])
        assert cv2.imwrite(str(path / "1.png"), np.zeros((side, side), np.uint8))
        (path / "truth.csv").write_text(BOX)
    if kind == "vot":
        (path / "truth.csv").unlink()
        (path / "groundtruth.txt").write_text(f"m0,0,{side},{side},5,{side * side - 5}\n")
    assert sum(file.stat().st_size for file in tmp_path.rglob("*") if file.is_file()) < 2e6
    done = subprocess.run(
        [sys.executable, "-c", LOOK, str(path)], capture_output=True, text=True, check=True
    )
    assert int(done.stdout) * 1024 < 2**30


def test_a_reader_that_cannot_look_says_where(tmp_path):
    with pytest.raises(SequenceError, match=r"can't be read \(File name too long\)"):
        readers.knows(tmp_path / ("a" * 300))
