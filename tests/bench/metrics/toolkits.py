"""Artificial boxes with recorded scores of toolkits, which the tests compare with ours.

The toolkits need other versions of Python and libraries. To record the scores again, install
`numpy<2 six got10k shapely` for Python 3.10 and `vot-toolkit==0.7.1` for Python 3.7. Then run:

    PYTHON-3.10 tests/bench/metrics/toolkits.py got10k
    PYTHON-3.7 tests/bench/metrics/toolkits.py vot

Each command writes a JSON file into the folder of this module. NumPy's old generator is used, as
its numbers are equal in all versions.
"""

import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SIZE = (320, 240)
LENGTHS = (160, 131, 173)
FAILURES = {0: [[], [40, 90]], 1: [[12], [12, 100]], 2: [[50], []]}
"""Frames of failure of two supervised runs, by sequence."""
ANCHORS = {0: (0, 60, -159), 1: (0, -100), 2: (20,)}
"""Start frames of runs by sequence; negative ones run backwards."""
SKIP = 5


def truth(i, absent=True):
    """Return the boxes of a sequence, shape (n, 4); NaN if the target is absent."""
    random = np.random.RandomState(100 + i)
    n = LENGTHS[i]
    place = 110 + 40 * i + np.cumsum(random.normal(0, 3, (n, 2)), axis=0)
    size = np.maximum(40 + np.cumsum(random.normal(0, 1, (n, 2)), axis=0), 5)
    boxes = np.round(np.column_stack([place, size]), 2)
    if absent and i == 1:
        boxes[70:80] = np.nan
    return boxes


def estimate(i, run=0):
    """Return the boxes of a tracker that drifts and recovers, shape (n, 4)."""
    random = np.random.RandomState(1000 + 10 * i + run)
    whole = truth(i, absent=False)
    n = len(whole)
    drift = 25 * np.sin(np.arange(n) / (7.0 + 3 * i + run))[:, None] ** 3 * [1, 0.5, 0.2, 0.2]
    boxes = np.round(whole + drift + random.normal(0, 2, (n, 4)), 2)
    boxes[:, 2:] = np.maximum(boxes[:, 2:], 1)
    lost = slice(n - 30 - 5 * run, n - 10)
    if i < 2:
        boxes[lost] += [300, 0, 0, 0]
    boxes[0] = whole[0]
    return boxes


def cover(i):
    """Return the visible share of the target in eighths, as in GOT-10k."""
    return np.random.RandomState(50 + i).randint(0, 9, LENGTHS[i])


def confidence(i):
    """Return confidences, shape (n,)."""
    return np.round(np.random.RandomState(70 + i).uniform(0, 1, LENGTHS[i]), 3)


def states(i, run):
    """Return the states of a supervised run: 0 skipped, 1 initialised, 2 failed, 3 tracked."""
    scores = np.full(LENGTHS[i], 3)
    scores[0] = 1
    for frame in FAILURES[i][run]:
        scores[frame], scores[frame + 1 : frame + SKIP], scores[frame + SKIP] = 2, 0, 1
    return scores


def from_anchor(boxes, anchor):
    """Return the rows of a run from an anchor, in temporal order of the run."""
    return boxes[anchor:] if anchor >= 0 else boxes[-anchor::-1]


def pairs():
    """Return pairs of boxes or polygons with boxes: at half pixels, small, or across the border."""
    random = np.random.RandomState(7)
    boxes = np.round(random.uniform(-20, 60, (60, 4)) * 2) / 2
    boxes[:, 2:] = np.abs(boxes[:, 2:]) + 2
    others = np.round(boxes + random.normal(0, 6, boxes.shape), 2)
    others[:, 2:] = np.maximum(others[:, 2:], 2)
    polygons = np.round(random.uniform(-30, 30, (60, 4, 2)) + boxes[:, None, :2] + 20, 2)
    angles = np.sort(random.uniform(0, 2 * np.pi, (60, 5)), axis=1)
    convex = boxes[:, None, :2] + 15 + 18 * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    return boxes, others, polygons, np.round(convex, 2)


THIN = (((10, 10, 1, 20), (10, 40, 1, 20)), ((5, 5, 1, 1), (5, 30, 1, 1)), ((-9, 0, 10, 20),) * 2)
"""Pairs of boxes with one visible column of pixels: two different pairs, then an equal one."""
MALFORMED = ((50, 50, 0, 0), (float("nan"),) * 4, (50, 50, -4, 9), (40, 40, float("inf"), 20))
"""Malformed estimates of a target at TARGET."""
TARGET = (40, 40, 20, 20)
SMALL = (60, 50)
"""Size of the image for `pairs`, which also reach beyond it."""


def record_got10k():
    """Return what the functions of got10k compute from malformed boxes."""
    from got10k.utils.metrics import center_error, rect_iou

    truth_boxes, estimates = np.array([TARGET] * len(MALFORMED), float), np.array(MALFORMED, float)
    malformed = {
        "distance": center_error(estimates, truth_boxes).tolist(),
        "overlap": rect_iou(estimates, truth_boxes).tolist(),
        "overlap cut": rect_iou(estimates, truth_boxes, SIZE).tolist(),
    }
    return {"malformed": malformed}


class _Sequence:
    """Sequence for the analyses of vot-toolkit."""

    def __init__(self, i):
        self.name, self.i, self.size = str(i), i, SIZE
        self.width, self.height = SIZE

    def __len__(self):
        return LENGTHS[self.i]

    def groundtruth(self, index=None):
        regions = _regions(truth(self.i))
        return regions if index is None else regions[index]

    def object(self, name, index=None):
        return None

    def values(self, index=None):
        truth_boxes = {abs(anchor): 1 if anchor >= 0 else -1 for anchor in ANCHORS[self.i]}
        return {"anchor": truth_boxes.get(index, 0)}


class _Trajectory:
    """Estimates of a tracker for the analyses of vot-toolkit."""

    def __init__(self, regions):
        self._regions = regions

    def __len__(self):
        return len(self._regions)

    def regions(self):
        return self._regions

    @classmethod
    def exists(cls, results, name):
        return True

    @classmethod
    def read(cls, results, name):
        i, start = name.split("_")
        anchor = next(a for a in ANCHORS[int(i)] if abs(a) == int(start))
        return cls(_regions(from_anchor(estimate(int(i)), anchor), first=1))


class _Experiment:
    anchor = "anchor"

    def results(self, tracker, sequence):
        return None


def _regions(boxes, first=3):
    from vot.region import Rectangle, Special

    codes = [first] + [3] * (len(boxes) - 1)
    return [
        Rectangle(*box) if code == 3 and not np.isnan(box[0]) else Special(code % 3)
        for box, code in zip(boxes.tolist(), codes)  # noqa: B905  # Python 3.7 knows no strict
    ]


def record_vot():
    """Return the scores of the analyses of vot-toolkit."""
    from vot.analysis import multistart
    from vot.region import Polygon, Rectangle, calculate_overlap

    sequences = [_Sequence(i) for i in range(3)]
    scores = {}

    multistart.Trajectory = _Trajectory
    each = [
        multistart.AccuracyRobustness().subcompute(_Experiment(), None, s, []) for s in sequences
    ]
    accuracy, robustness = multistart.AverageAccuracyRobustness().aggregate(None, sequences, each)[
        :2
    ]
    curves = multistart.EAOCurves(high=755)
    phi = [curves.subcompute(_Experiment(), None, s, []) for s in sequences]
    (curve,) = multistart.EAOCurve(high=755).aggregate(None, sequences, phi)
    scores["anchors"] = {
        "sequences": [result[:2] for result in each],
        "accuracy": accuracy,
        "robustness": robustness,
        "curve": list(curve),
    }

    scores["thin"] = [calculate_overlap(Rectangle(*a), Rectangle(*b), SIZE) for a, b in THIN]
    boxes, others, polygons, convex = pairs()
    shapes = {
        "boxes": [Rectangle(*box) for box in boxes],
        "polygons": [Polygon(points.tolist()) for points in polygons],
        "convex": [Polygon(points.tolist()) for points in convex],
    }
    for kind, regions in shapes.items():
        for cut, bounds in (("", None), (" cut", SMALL)):
            scores[kind + cut] = [
                calculate_overlap(region, Rectangle(*box), bounds)
                for region, box in zip(regions, others)  # noqa: B905  # as above
            ]
    return scores


if __name__ == "__main__":
    toolkit = sys.argv[1]
    recorded = record_got10k() if toolkit == "got10k" else record_vot()
    text = json.dumps(recorded, default=float, sort_keys=True)
    (HERE / ("recorded_" + toolkit + ".json")).write_text(text + "\n")
