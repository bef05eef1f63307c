"""Compact encoding of frames and boxes for the player of a page."""

import io
import zlib
from base64 import b64encode
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

STEP = 0.02
"""Resolution of box coordinates [px], so that overlaps are those of the tables to two digits."""

ABSENT = -(2**31)
"""Code of the coordinates of a missing box."""

_CHUNK_SIZE = 400_000  # bytes of frames that the player decodes together
_MAX_WAITING = 32  # frames that wait for an encoding thread
_MAX_PNG_SIZE = 200_000  # bytes; plots are smaller, and PNG keeps them sharp
_MAX_PICTURE_SIZE = 4000, 16_000  # pixels; a side of WebP has at most 16 383
_THUMBNAIL_SIZE = 88, 66  # pixels
_CONTEXT = 2.0  # height of a thumbnail, in multiples of the longer side of the target
_EFFORT = 2  # effort of the WebP encoder, 0 to 6: more takes much longer and saves little


def encode_images(
    images: Iterable[NDArray[np.uint8] | None], height: int | None = None, quality: int = 60
) -> Iterator[list[bytes]]:
    """Encode BGR images as WebP in parallel; yield chunks of frames in order.

    Higher images are reduced to `height` [px]. `quality` is that of WebP, from 0 to 100. None as an
    image becomes an empty frame.
    """
    chunk: list[bytes] = []
    size = 0
    for frame in _encoded(images, height, quality):
        if size + len(frame) > _CHUNK_SIZE and chunk:
            yield chunk
            chunk, size = [], 0
        chunk.append(frame)
        size += len(frame)
    if chunk:
        yield chunk


def _encoded(
    images: Iterable[NDArray[np.uint8] | None], height: int | None, quality: int
) -> Iterator[bytes]:
    waiting: deque[Future[bytes]] = deque()
    with ThreadPoolExecutor() as threads:
        for image in images:
            waiting.append(threads.submit(_webp, image, height, quality))
            if len(waiting) > _MAX_WAITING:
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
    return _encode(Image.fromarray(np.ascontiguousarray(image[..., ::-1])), quality)


def _encode(picture: Image.Image, quality: int) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, "WEBP", quality=quality, method=_EFFORT)
    return stream.getvalue()


def pack_frames(frames: Sequence[bytes]) -> str:
    """Encode a chunk of frames as text; before each frame is its size in four bytes."""
    chunk = b"".join(len(frame).to_bytes(4, "little") + frame for frame in frames)
    return b64encode(chunk).decode()


def compress_picture(png: bytes) -> bytes:
    """Convert a large PNG, such as a film strip, to WebP; return smaller ones unchanged."""
    if len(png) <= _MAX_PNG_SIZE:
        return png
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    picture.thumbnail(_MAX_PICTURE_SIZE)
    return _encode(picture, 80)


def thumbnail(frame: bytes, box: NDArray[np.float64] | None = None) -> bytes:
    """Return a WebP frame in the size of a thumbnail; empty for an empty frame.

    `box`: x, y, width and height in shares of the frame. The thumbnail shows the part of the frame
    around it, since sequences of one scene differ in the target only.
    """
    if not frame:
        return b""
    picture: Image.Image = Image.open(io.BytesIO(frame))
    if box is not None and np.isfinite(box).all():
        size = np.array(picture.size)
        centre, reach = (box[:2] + box[2:] / 2) * size, _CONTEXT * max(box[2:] * size) / 2
        half = reach * np.array(_THUMBNAIL_SIZE) / _THUMBNAIL_SIZE[1]
        half *= min(1.0, *(size / 2 / half))
        centre = centre.clip(half, size - half)
        picture = picture.crop(tuple(np.rint([*(centre - half), *(centre + half)]).astype(int)))
        picture = picture.resize(_THUMBNAIL_SIZE)
    picture.thumbnail(_THUMBNAIL_SIZE)
    return _encode(picture, 50)


def quantise(boxes: NDArray[Any]) -> NDArray[np.int32]:
    """Convert boxes (n, 4) from pixels to multiples of `STEP`; `ABSENT` if one is not finite."""
    finite = np.isfinite(boxes).all(axis=1, keepdims=True)
    limit = -ABSENT - 1
    # Clipped before the division, which would overflow, and after it, as it rounds.
    clipped = np.where(finite, boxes, 0.0).clip(-limit * STEP, limit * STEP)
    steps = np.rint(clipped / STEP).clip(-limit, limit)
    return np.where(finite, steps, ABSENT).astype(np.int32)


def pack_boxes(boxes: NDArray[np.int32]) -> str:
    """Encode quantised boxes (k, n, 4) as text: differences of frames, grouped by byte position."""
    # Differences can wrap around, as do the sums that undo them.
    steps = np.diff(boxes, axis=1, prepend=np.zeros_like(boxes[:, :1]))
    planes = steps.astype("<i4").reshape(-1, 1).view(np.uint8).T
    return compress(planes.tobytes())


def compress(payload: bytes) -> str:
    """Compress content and encode it as text."""
    return b64encode(zlib.compress(payload)).decode()
