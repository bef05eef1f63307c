"""Frames and boxes as a page's player reads them: small, and each frame by itself."""

import io
import zlib
from base64 import b64encode
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

STEP = 0.1
"""What coordinates of boxes are rounded to [pixels]."""

ABSENT = -(2**31)
"""Stands for the coordinates of a box that is not there."""

_CHUNK = 400_000  # bytes of frames that the player unpacks together
_AHEAD = 32  # frames that wait for a thread to encode them
_MOST_STILL = 200_000  # bytes; plots are smaller, and sharper as they are
_LARGEST_STILL = 4000, 16_000  # pixels; WebP knows no side longer than 16 383
_EFFORT = 2  # of WebP's encoder, 0 to 6: from here on files shrink little and take much longer


def film(
    images: Iterable[NDArray[np.uint8] | None], height: int | None = None, quality: int = 60
) -> Iterator[list[bytes]]:
    """Encode BGR images as WebP, at most so high [pixels], side by side while they are read.

    `quality`: of WebP, 0 to 100. None comes to an empty frame. Gives the frames in order, in chunks
    that are unpacked together.
    """
    chunk: list[bytes] = []
    held = 0
    for frame in _encoded(images, height, quality):
        if held + len(frame) > _CHUNK and chunk:
            yield chunk
            chunk, held = [], 0
        chunk.append(frame)
        held += len(frame)
    if chunk:
        yield chunk


def _encoded(
    images: Iterable[NDArray[np.uint8] | None], height: int | None, quality: int
) -> Iterator[bytes]:
    waiting: deque[Future[bytes]] = deque()
    with ThreadPoolExecutor() as threads:
        for image in images:
            waiting.append(threads.submit(_webp, image, height, quality))
            if len(waiting) > _AHEAD:
                yield waiting.popleft().result()
        for last in waiting:
            yield last.result()


def _webp(image: NDArray[np.uint8] | None, height: int | None, quality: int) -> bytes:
    if image is None:
        return b""
    tall, wide = image.shape[:2]
    if height is not None and tall > height:
        size = max(1, round(wide * height / tall)), height
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    stream = io.BytesIO()
    picture = Image.fromarray(np.ascontiguousarray(image[..., ::-1]))
    picture.save(stream, "WEBP", quality=quality, method=_EFFORT)
    return stream.getvalue()


def still(content: bytes) -> bytes:
    """A figure (PNG) as a page holds it: film strips, which would fill it, as WebP of full size."""
    if len(content) <= _MOST_STILL:
        return content
    picture = Image.open(io.BytesIO(content)).convert("RGB")
    picture.thumbnail(_LARGEST_STILL)
    stream = io.BytesIO()
    picture.save(stream, "WEBP", quality=80, method=_EFFORT)
    return stream.getvalue()


def quantised(boxes: NDArray[Any]) -> NDArray[np.int32]:
    """Boxes (n, 4) in pixels as whole numbers of `STEP`; `ABSENT` where one is not finite."""
    known = np.isfinite(boxes).all(axis=1, keepdims=True)
    most = -ABSENT - 1
    near = np.where(known, boxes, 0.0).clip(
        -most * STEP, most * STEP
    )  # else the division overflows
    return np.where(known, np.rint(near / STEP).clip(-most, most), ABSENT).astype(np.int32)


def packed(boxes: NDArray[np.int32]) -> str:
    """Quantised boxes (k, n, 4) as text: steps from frame to frame, by bytes of equal weight."""
    steps = np.diff(boxes, axis=1, prepend=np.zeros_like(boxes[:, :1]))  # wraps, as it is undone
    planes = steps.astype("<i4").reshape(-1, 1).view(np.uint8).T
    return squeezed(planes.tobytes())


def squeezed(content: bytes) -> str:
    """Compressed content as text."""
    return b64encode(zlib.compress(content)).decode()
