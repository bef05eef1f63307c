"""Independent readers of ground truth.

Each function has the name of a function of `layouts`. It takes the folder and the number of images,
and returns one box per frame, or None without target. It also accepts files that `datasets.readers`
refuses. If both accept a file, the boxes must be equal.
"""

import csv
import re
from math import isnan

import numpy as np
from PIL import Image


def lines_of(path):
    return path.read_bytes().decode("utf-8-sig").rstrip().splitlines()


def row_of(line):
    return [
        float(word)
        for word in re.sub(r"\s+", ",", re.sub(r"\s*,\s*", ",", line.strip())).split(",")
    ]


def rows_of(path):
    return [row_of(line) for line in lines_of(path)]


def is_present(row, first=False):
    """Return whether the target of a row x, y, width, height is present."""
    return not any(map(isnan, row)) and (first or min(row[2:]) > 0)


def boxes_from(rows, origin):
    return [
        [row[0] - origin, row[1] - origin, *row[2:]] if is_present(row, i == 0) else None
        for i, row in enumerate(rows)
    ]


def without_flagged(boxes, flags):
    """Return the boxes, with None instead of a box in flagged frames."""
    return [None if flag else box for box, flag in zip(boxes, flags, strict=True)]


def flags_of(path, n):
    """Read the flags of n frames; empty lines are skipped, a missing file sets no flag."""
    if not path.is_file():
        return [0] * n
    lines = filter(str.strip, lines_of(path))
    return [int(float(word)) for line in lines for word in row_of(line)]


def truth_csv(path):
    rows = [line for line in lines_of(path) if line.strip() and not line.lstrip().startswith("#")]
    boxes = []
    for cells in list(csv.reader(rows, quoting=csv.QUOTE_NONE))[1:]:
        boxes += [None] * (int(cells[0]) - len(boxes))
        boxes.append(
            [float(cell) for cell in cells[1:5]] if any(map(str.strip, cells[1:5])) else None
        )
    return boxes


def images(data, n):
    return truth_csv(data / "walk" / "truth.csv")


def otb(data, n):
    return boxes_from(rows_of(data / "walk" / "groundtruth_rect.txt"), 1)


def davis(data, n):
    folder = data / "Annotations" / "480p" / "walk"
    masks = [np.asarray(Image.open(file)) for file in sorted(folder.glob("*.png"))]
    values = sorted({int(value) for mask in masks for value in np.unique(mask)} - {0})
    value = values[0] if values == [255] else min(set(values) - {255})
    return [around(np.argwhere(mask == value)[:, ::-1]) for mask in masks]


def around(points):
    """Return the box around whole pixels (x, y)."""
    if not len(points):
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    return [*low.tolist(), *(high - low + 1).tolist()]


def video(data, n):
    return truth_csv(data / "walk.csv")


def avi(data, n):
    return [None] * n


def vot_region(line, first):
    if line.lstrip().startswith("m"):
        x, y, width, _, *runs = map(int, row_of(line.strip()[1:]))
        ends = np.cumsum(runs).tolist()
        inside = [
            (x + offset % width, y + offset // width)
            for start, end in zip(ends[::2], ends[1::2], strict=False)
            for offset in range(start, end)
        ]
        return around(np.array(inside))
    row = row_of(line)
    if len(row) > 4:
        if all(map(isnan, row)):
            return None
        xs, ys = row[::2], row[1::2]
        row = [min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)]
    return row if len(row) == 4 and is_present(row, first) else None


def vot_classic(data, n):
    lines = lines_of(data / "walk" / "groundtruth.txt")
    return [vot_region(line, i == 0) for i, line in enumerate(lines)]


vot_current = vot_classic


def got10k(data, n):
    walk = data / "walk"
    boxes = boxes_from(rows_of(walk / "groundtruth.txt"), 1)
    boxes += [None] * (n - 1 if len(boxes) == 1 else 0)
    return without_flagged(boxes, flags_of(walk / "absence.label", len(boxes)))


def lasot(data, n):
    walk = data / "walk"
    boxes = boxes_from(rows_of(walk / "groundtruth.txt"), 1)
    hidden, away = (
        flags_of(walk / f"{name}.txt", len(boxes)) for name in ("full_occlusion", "out_of_view")
    )
    return without_flagged(without_flagged(boxes, hidden), away)


def trackingnet(data, n):
    boxes = boxes_from(rows_of(data / "TRAIN_0" / "anno" / "walk.txt"), 0)
    return boxes + [None] * (n - 1 if len(boxes) == 1 else 0)


def uav123(data, n):
    return boxes_from(rows_of(data / "anno" / "UAV123" / "walk.txt"), 1)


def nfs(data, n):
    rows = [
        [float(word) for word in line.replace(",", " ").split()[1:7]]
        for line in lines_of(data / "walk" / "30" / "walk.txt")
    ]
    rows = rows[::8][:n] if 8 * n - 8 < len(rows) < 8 * n + 8 else rows
    sides = [[left, top, right - left, bottom - top] for left, top, right, bottom, *_ in rows]
    return without_flagged(boxes_from(sides, 0), [row[5] for row in rows])


def tcolor128(data, n):
    return boxes_from(rows_of(data / "walk" / "walk_gt.txt"), 1)


def tlp(data, n):
    rows = rows_of(data / "walk" / "groundtruth_rect.txt")
    if len(rows[0]) == 4:  # only six columns distinguish TLP from OTB
        return otb(data, n)
    return without_flagged(boxes_from([row[1:5] for row in rows], 0), [row[5] for row in rows])


def mot(data, n):
    targets = {}
    for frame, target, x, y, width, height, counts, *_ in rows_of(data / "walk" / "gt" / "gt.txt"):
        if counts > 0:
            targets.setdefault(target, {})[int(frame) - 1] = [x - 1, y - 1, width, height]
    longest = max(sorted(targets), key=lambda target: len(targets[target]))
    return [targets[longest].get(frame) for frame in range(n)]
