"""What the tests of datasets share: files as users have them, made on the spot."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

RECORDED = Path(__file__).parents[2].parent / "shared" / "sequences"


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    """A cache folder of the test's own."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("TRACKMARK_CACHE", str(folder))
    return folder


@pytest.fixture
def recorded():
    """The folder of real recorded sequences, where there is one."""
    if not RECORDED.is_dir():
        pytest.skip("no recorded sequences beside the checkout")
    return RECORDED


def picture(i, width=48, height=32):
    """A smooth image, another for every i."""
    y, x = np.mgrid[:height, :width]
    planes = [x * 4 + i * 9, y * 6 + i * 5, (x + y) * 2 + i * 13]
    return np.stack([np.abs(plane % 400 - 200) for plane in planes], axis=-1).astype(np.uint8)


@pytest.fixture
def write_images():
    """Writes images with the given names into a folder, and gives their pixels."""

    def write(folder, names, size=(48, 32)):
        folder.mkdir(parents=True, exist_ok=True)
        images = [picture(i, *size) for i in range(len(names))]
        for name, image in zip(names, images, strict=True):
            assert cv2.imwrite(str(folder / name), image)
        return images

    return write


@pytest.fixture
def write_video():
    """Writes a video file of n frames that differ, key frames every 12, with B-frames."""

    def write(
        path, codec="libx264", n=40, b_frames=2, rotation=0, options=(), title="", size=(96, 64)
    ):
        with av.open(path, "w") as container:
            container.metadata["title"] = title
            stream = container.add_stream(codec, rate=Fraction(25), options=dict(options))
            (stream.width, stream.height), stream.pix_fmt = size, "yuv420p"
            stream.codec_context.gop_size = 12
            stream.codec_context.max_b_frames = b_frames
            if rotation:
                stream.set_display_rotation(rotation)
            for i in range(n):
                image = picture(i, *size)
                frame = av.VideoFrame.from_ndarray(image, format="bgr24")
                container.mux(stream.encode(frame))
            container.mux(stream.encode())
        return path

    return write


@pytest.fixture
def write_otb(write_images):
    """Writes an OTB folder with this text as its truth."""

    def write(folder, truth, n=3, attrs=None):
        write_images(folder / "img", [f"{i + 1:04d}.jpg" for i in range(n)])
        (folder / "groundtruth_rect.txt").write_bytes(truth.encode())
        if attrs is not None:
            (folder / "attrs.txt").write_text(attrs)
        return folder

    return write
