"""Runs of the template tracker whose occlusions are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from bench.evaluation.record import Run
from bench.store.truth import StoredTruth

N = 120


def moving(n=N):
    """Boxes of a target that never makes two equal steps."""
    k = np.arange(n, dtype=float)
    wobble = np.sin(k), np.cos(1.3 * k), 0.3 * np.sin(0.7 * k), 0.4 * np.sin(0.7 * k)
    return np.stack([40 + k, 60 + 0.5 * k, np.full(n, 60.0), np.full(n, 80.0)], 1) + np.stack(
        wobble, 1
    )


@pytest.fixture(scope="session")
def made_run():
    """Makes a run that declared `events`: beginning, end, and frame in which it is back, or None.

    It is on the target wherever it follows it; `beside` are frames in which it is 100 pixels off,
    `parameters` those of the tracker that matter here.
    """

    def make(*events, n=N, beside=(), revised_beside=None, **parameters):
        target = moving(n)
        online, revised = target.copy(), target.copy()
        online[list(beside), 0] += 100
        revised[list(beside if revised_beside is None else revised_beside), 0] += 100
        details = _details(events, n)
        for beginning, end, back in events:
            last = n if back is None else back
            step = target[beginning - 1] - target[beginning - 2]
            ahead = np.arange(1, last - beginning + 1)[:, None]
            online[beginning:last] = revised[beginning - 1] + ahead * step
            if back is None:  # nothing else tells its end
                revised[beginning:] = online[beginning:]
                if end is not None:
                    share = np.arange(1, end - beginning + 1)[:, None] / (end - beginning + 1)
                    start = revised[beginning - 1]
                    revised[end:] = target[end:]
                    revised[beginning:end] = start + share * (revised[end] - start)
        usual = {"longest_occlusion": 35, "candidates": "skipped"}
        return Run(
            identity=SimpleNamespace(parameters=usual | parameters),
            boxes=online,
            visible=details["occluded"] != 1,
            confidence=np.full(n, np.nan),
            details=details,
            revised=revised if events else None,
        )

    return make


def _details(events, n):
    """What the tracker says in each frame, when these are the occlusions."""
    details = {name: np.zeros(n) for name in ("occluded", "revision", "ended")}
    details |= {name: np.full(n, np.nan) for name in ("beginning", "end", "candidate")}
    details["outliers"] = np.full(n, 0.125)
    known = 0  # frame in which the one before is over, and what comes after it is seen
    for beginning, end, back in events:
        declared, last = max(beginning, known), n if back is None else back
        details["occluded"][declared:last] = 1
        if declared < n:
            _tell(details["beginning"], declared, beginning)
            details["candidate"][declared:last] = np.nan if end is None else end
        if back is not None:
            _tell(details["end"], back, end)
            details["revision"][back] = max(details["revision"][back], back - beginning)
            details["ended"][back:] += 1
        known = last
    for values in details.values():
        values[0] = np.nan
    return details


def _tell(told, frame, value):
    """In the first frame from one on in which nothing is told yet, if there is one."""
    free = frame + np.flatnonzero(np.isnan(told[frame:]))
    told[free[:1]] = value


@pytest.fixture(scope="session")
def made_truth():
    """Makes the truth of that target, hidden in stretches of frames (both ends count)."""

    def make(*hidden, n=N, shown=0.0, off=None):
        visibility = np.ones(n)
        for first, last in hidden:
            visibility[first : last + 1] = shown
        attributes = {}
        if off is not None:
            flags = np.zeros(n, bool)
            flags[off[0] : off[1]] = True
            attributes["lamp off"] = flags
        return StoredTruth("made", moving(n), {}, visibility, attributes, 25.0)

    return make
