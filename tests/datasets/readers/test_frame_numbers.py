"""Frame numbers in the names of images: two images of one number are refused."""

import pytest

from trackmark import datasets
from trackmark.datasets import SequenceError

COPIES = [
    "0003.jpg",
    "3.png",
    "0003.PNG",
    "0003 (1).png",
    "0003(2).png",
    "0003 copy.png",
    "0003 copy 2.png",
    "0003 2.png",
    "0003 - Copy.png",
    "0003 - Copy (2).png",
    "0003 - Kopie.png",
    "0003 (Kopie).png",
    "0003 – копия.png",
    "0003 のコピー.png",
    "0003~.png",
    "0003_1.png",
    "Copy of 0003.png",
    "Kopie von 0003.png",
]

DISTINCT = {
    "unpadded": ["1.png", "2.png", "9.png", "10.png", "11.png"],
    "prefix": ["img00001.jpg", "img00002.jpg", "img00003.jpg"],
    "prefix and padding": ["frame_9.png", "frame_10.png", "frame_100.png"],
    "constant step": ["0000.png", "0005.png", "0010.png", "0015.png"],
    "gaps": ["0001.png", "0002.png", "0007.png"],
    "two suffixes": ["1.png", "2.jpg", "3.bmp"],
    "two clips": ["a_001.png", "a_002.png", "b_001.png", "b_002.png"],
    "camera and frame": ["cam0_001.png", "cam0_002.png", "cam1_001.png", "cam1_002.png"],
    "times": ["1305031102.175304.png", "1305031102.211214.png", "1305031103.175304.png"],
    "frame and time": ["0001_12.png", "0002_12.png", "0003_19.png"],
    "colour and depth": ["color_01.png", "color_02.png", "depth_01.png", "depth_02.png"],
    "depth by another prefix": ["01.png", "02.png", "d01.png", "d02.png"],
    "no numbers": ["a.png", "b.png", "b2.png", "ca.png"],
    "hidden files": ["0001.png", "0002.png", "._0002.png", ".0002 (1).png"],
}


@pytest.mark.parametrize("name", COPIES)
def test_copied_image_is_refused_by_both_names(tmp_path, write_images, name):
    write_images(tmp_path / "walk", [*(f"{i:04}.png" for i in range(1, 6)), name])
    with pytest.raises(SequenceError) as raised:
        datasets.load(tmp_path / "walk")
    message = str(raised.value)
    assert "\n" not in message
    assert "0003.png" in message
    assert name in message
    assert "same frame number" in message
    assert "Remove" in message


@pytest.mark.parametrize("name", ["Copy of img03.png", "IMG03.png", "img03 (1).png", "img03b.png"])
def test_copied_image_with_prefix_is_refused(tmp_path, write_images, name):
    write_images(tmp_path / "walk", ["img01.png", "img02.png", "img03.png", "img04.png", name])
    with pytest.raises(SequenceError, match="same frame number as "):
        datasets.load(tmp_path / "walk")


@pytest.mark.parametrize("case", DISTINCT)
def test_distinct_numbers_are_accepted(tmp_path, write_images, case):
    write_images(tmp_path / "walk", DISTINCT[case])
    for name in (".DS_Store", "Thumbs.db"):
        (tmp_path / "walk" / name).write_text("")
    visible = [name for name in DISTINCT[case] if not name.startswith(".")]
    assert len(datasets.load(tmp_path / "walk")) == len(visible)
