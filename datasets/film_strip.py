"""Small film strips of images with boxes, for notebooks."""

import base64
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.interface import Array

MAX_BYTES = 60_000
"""Maximum size of a film strip as a JPEG image."""

_WIDTH = 320  # maximum width of an image [px]
_COLOURS = ((0, 200, 0), (0, 0, 255))  # BGR of the first and the second box


def film_strip(images: Sequence[NDArray[np.uint8]], boxes: Sequence[Sequence[Array]]) -> str:
    """Return an HTML element with images side by side, as JPEG of at most `MAX_BYTES`.

    `images`: BGR images of equal size, at least one. `boxes`: up to two boxes per image, shape
    (4,); the first one is drawn green, the second one red. Boxes that are not finite are not drawn.
    """
    scale = min(1.0, _WIDTH / images[0].shape[1])
    while True:
        drawn = [_draw(*pair, scale) for pair in zip(images, boxes, strict=True)]
        quality = [cv2.IMWRITE_JPEG_QUALITY, 85]
        jpeg = cv2.imencode(".jpg", np.hstack(drawn), quality)[1].tobytes()
        if len(jpeg) <= MAX_BYTES:
            encoded = base64.b64encode(jpeg).decode()
            return f'<img alt="frames with boxes" src="data:image/jpeg;base64,{encoded}">'
        scale *= 0.8


def _draw(image: NDArray[np.uint8], boxes: Sequence[Array], scale: float) -> NDArray[np.uint8]:
    resized = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small: NDArray[np.uint8] = np.array(resized, np.uint8)
    for box, colour in zip(boxes, _COLOURS, strict=False):
        if np.isfinite(box).all():
            x, y, width, height = np.clip(np.asarray(box) * scale, -1e4, 1e4).round().astype(int)
            corner = int(x + width), int(y + height)
            cv2.rectangle(small, (int(x), int(y)), corner, colour, 1)
    return small
