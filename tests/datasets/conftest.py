"""Fixtures of the dataset tests: image, video and OTB files that are written on request."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

RECORDED = Path(__file__).parents[2].parent / "shared" / "sequences"


@pytest.fixture(autouse=True)
def cache(tmp_path_factory, monkeypatch):
    """Cache folder of this test."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("TRACKMARK_CACHE", str(folder))
    return folder


@pytest.fixture
def recorded():
    """Folder of recorded sequences; the test is skipped without it."""
    if not RECORDED.is_dir():
        pytest.skip("no recorded sequences next to the checkout")
    return RECORDED


def picture(i, width=48, height=32):
    """Return a smooth image that depends on i."""
    y, x = np.mgrid[:height, :width]
    planes = [x * 4 + i * 9, y * 6 + i * 5, (x + y) * 2 + i * 13]
    return np.stack([np.abs(plane % 400 - 200) for plane in planes], axis=-1).astype(np.uint8)


@pytest.fixture
def write_images():
    """Write images with the given names into a folder, and return their pixels."""

    def write(folder, names, size=(48, 32)):
        folder.mkdir(parents=True, exist_ok=True)
        images = [picture(i, *size) for i in range(len(names))]
        for name, image in zip(names, images, strict=True):
            assert cv2.imwrite(str(folder / name), image)
        return images

    return write


@pytest.fixture
def write_video():
    """Write a video file of n different frames with a key frame every 12 frames."""

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
    """Write an OTB folder with this text as ground truth."""

    def write(folder, truth, n=3, attrs=None):
        write_images(folder / "img", [f"{i + 1:04d}.jpg" for i in range(n)])
        (folder / "groundtruth_rect.txt").write_bytes(truth.encode())
        if attrs is not None:
            (folder / "attrs.txt").write_text(attrs)
        return folder

    return write
