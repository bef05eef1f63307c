"""MP4 videos (H.264) of sequences with the boxes of all trackers."""

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from trackmark.reports.overlay import TRUTH, legend, overlay
from trackmark.reports.palette import colours

DEFAULT_FPS = 25.0
MIN_WIDTH = 480
"""Width to which narrower images are enlarged, so that boxes and texts are readable [px]."""


def save_video(
    file: Path,
    images: Iterable[tuple[int, NDArray[np.uint8]]],
    boxes: Mapping[str, NDArray[np.float64]],
    fps: float | None = None,
    lines_of: Callable[[int], Mapping[str, NDArray[np.float64]]] = lambda _: {},
) -> None:
    """Save an MP4 file with one frame in memory at a time.

    `images` are frame numbers with BGR images, all of one size. `boxes` contains boxes of the shape
    (n, 4) by label, a row per frame. `lines_of` returns the outlines of a frame by label, which are
    drawn as in `overlay`.
    """
    shades = colours([label for label in boxes if label != TRUTH])
    with av.open(str(file), "w", format="mp4") as container:
        stream = None
        for frame, image in images:
            scale = max(1.0, MIN_WIDTH / image.shape[1])
            frame_boxes = {label: rows[frame] for label, rows in boxes.items()}
            drawn = overlay(image, frame_boxes, shades, scale, str(frame), lines=lines_of(frame))
            if boxes:
                drawn = np.vstack([drawn, legend(boxes, shades, drawn.shape[1])])
            height, width = drawn.shape[:2]  # even, as the pixel format requires
            pad = ((0, height % 2), (0, width % 2), (0, 0))
            drawn = np.ascontiguousarray(np.pad(drawn, pad, "edge"))
            if stream is None:
                rate = Fraction(fps or DEFAULT_FPS).limit_denominator(100_000)
                stream = container.add_stream("libx264", rate=rate)
                stream.height, stream.width = drawn.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": "18"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(drawn, format="bgr24")))
        if stream is None:
            raise OSError("there are no frames")
        container.mux(stream.encode())
