"""A clip with a known target and an occlusion, and the tracker of Nguyen & Smeulders on it."""

import cv2
import numpy as np

from trackmark import trackers

ROWS, COLUMNS, WIDTH, HEIGHT = 64, 110, 18, 16


def texture(random, rows, columns, colour, contrast):
    noise = cv2.GaussianBlur(random.normal(0, contrast, (rows, columns, 3)), (0, 0), 1.2)
    return np.array(colour) + 3 * noise


def clip(n_frames=36, hidden=7, start=10, seed=0, noise=2.5):
    """A coloured target that moves and grows; from `start` on a board passes over it.

    It covers the target wholly for `hidden` frames.
    """
    random = np.random.default_rng(seed)
    wall = texture(random, ROWS, COLUMNS, (120, 125, 115), 15)
    target = texture(random, HEIGHT, WIDTH, (70, 110, 190), 25)
    board_width = WIDTH + 5 * hidden
    board = texture(random, ROWS, board_width, (150, 90, 60), 20)
    images, boxes = [], []
    for frame in range(n_frames):
        x, y, scale = 14 + 0.9 * frame, 20 + 0.3 * frame, 1 + 0.002 * frame
        placed = np.array([[scale, 0, x], [0, scale, y]])
        size = COLUMNS, ROWS
        share = cv2.warpAffine(np.ones((HEIGHT, WIDTH)), placed, size)[:, :, np.newaxis]
        image = wall * (1 - share) + cv2.warpAffine(target, placed, size)
        left = round(x) - board_width + 5 * (frame - start)
        seen = slice(max(left, 0), max(left + board_width, 0))
        if frame >= start:
            part = board[:, max(-left, 0) :][:, : max(COLUMNS - max(left, 0), 0)]
            image[:, seen] = part
        image += random.normal(0, noise, image.shape)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
        # The first pixel's centre comes to lie at x: its box begins half a (scaled) pixel before.
        corner = np.array([x, y]) + 0.5 - scale / 2
        boxes.append([*corner, WIDTH * scale, HEIGHT * scale])
    return images, np.array(boxes)


def create_tracker(images, box, **parameters):
    tracker = trackers.create("nguyen2002", **parameters)
    tracker.init(images[0], np.asarray(box, float))
    return tracker


def track(images, box, **parameters):
    tracker = create_tracker(images, box, **parameters)
    return [tracker.update(image) for image in images[1:]], dict(tracker.finish())


def revised(box, estimates, last):
    """Return the first box and the estimates' boxes with their revisions."""
    boxes = np.array([box] + [estimate.box for estimate in estimates])
    for better in [*(estimate.revised or {} for estimate in estimates), last]:
        for frame, expected_places in better.items():
            boxes[frame] = expected_places
    return boxes
