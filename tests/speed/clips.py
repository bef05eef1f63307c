"""Cached clips of the speed tests: images and boxes."""

from functools import cache

import cv2
import numpy as np


def textured(rng, rows, columns, scale):
    noise = cv2.GaussianBlur(rng.uniform(0, 1, (rows, columns, 3)), (0, 0), scale)
    return cv2.normalize(noise, None, 0, 255, cv2.NORM_MINMAX)


def finished(images, boxes):
    return [np.clip(image, 0, 255).astype(np.uint8) for image in images], np.array(boxes, float)


@cache
def large():
    """Return a clip of 640x480 pixels: a textured target of 60x140 on multicoloured ground."""
    rng = np.random.default_rng(0)
    ground = np.zeros((480, 640, 3))
    for scale in (3, 12, 40):
        noise = cv2.GaussianBlur(rng.uniform(0, 1, ground.shape), (0, 0), scale)
        ground += cv2.normalize(noise, None, 0, 80, cv2.NORM_MINMAX)
    target = np.empty((140, 60, 3))
    target[:70], target[70:] = (45, 45, 190), (180, 70, 40)
    target += cv2.GaussianBlur(rng.normal(0, 60, target.shape), (0, 0), 2)
    images, boxes = [], []
    for frame in range(40):
        image = ground + rng.normal(0, 4, ground.shape)
        x, y = round(290 + 120 * np.sin(frame / 14)), round(170 + 80 * np.cos(frame / 11))
        image[y : y + 140, x : x + 60] = target + rng.normal(0, 4, target.shape)
        images.append(image)
        boxes.append((x, y, 60, 140))
    return finished(images, boxes)


@cache
def small():
    """Return a clip of 142x115 pixels, as in Wang & Tang: a ball of 12 pixels."""
    rng = np.random.default_rng(0)
    ground = cv2.GaussianBlur(rng.uniform(0, 255, (115, 142, 3)), (0, 0), 2)
    images, boxes = [], []
    for frame in range(40):
        image = ground + rng.normal(0, 4, ground.shape)
        x, y = round(65 + 40 * np.sin(frame / 14)), round(50 + 30 * np.cos(frame / 11))
        image[y : y + 12, x : x + 12] = (40, 140, 230) + rng.normal(0, 6, (12, 12, 3))
        images.append(image)
        boxes.append((x, y, 12, 12))
    return finished(images, boxes)


@cache
def disc():
    """Return a clip of 320x240 pixels: a disc of changing colour before multicoloured discs."""
    random = np.random.default_rng(0)
    ground = np.full((240, 320, 3), 110.0)
    for _ in range(150):
        x, y, radius = int(random.integers(320)), int(random.integers(240)), random.integers(6, 22)
        cv2.circle(ground, (x, y), int(radius), random.integers(20, 235, 3).tolist(), -1)
    images, boxes = [], []
    for frame in range(40):
        image = ground.copy()
        x, y = round(160 + 60 * np.sin(frame / 12)), round(120 + 40 * np.cos(frame / 9))
        colour = 128 + 90 * np.sin(frame / 9 + np.arange(3))
        cv2.circle(image, (x, y), 24, colour.tolist(), -1)
        images.append(image + random.normal(0, 5, image.shape))
        boxes.append((x - 24, y - 24, 49, 49))
    return finished(images, boxes)


@cache
def hidden():
    """Return a clip of 320x240 pixels: a board occludes the target in frames 50 to 90."""
    rng = np.random.default_rng(0)
    ground, target = textured(rng, 240, 320, 4), textured(rng, 80, 60, 2)
    board = textured(rng, 240, 96, 6)
    images, boxes = [], []
    for frame in range(120):
        x, y = round(100 + 40 * np.sin(frame / 20)), round(80 + 20 * np.cos(frame / 15))
        image = ground + rng.normal(0, 2, ground.shape)
        image[y : y + 80, x : x + 60] = target + rng.normal(0, 2, target.shape)
        left = round(-96 + 8 * (frame - 45))
        seen = slice(max(left, 0), min(left + 96, 320))
        if seen.stop > seen.start:
            image[:, seen] = board[:, seen.start - left : seen.stop - left]
        images.append(image)
        boxes.append((x, y, 60, 80))
    return finished(images, boxes)
