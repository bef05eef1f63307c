"""Runs of the template tracker with known occlusions."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.store.truth import StoredTruth
from trackmark.trackers.templates.occlusion import OcclusionLog

N = 120


def true_boxes():
    """Return boxes of a target that never makes two equal steps."""
    k = np.arange(N)
    x, y = 40 + k + np.sin(k), 60 + 0.5 * k + np.cos(1.3 * k)
    return np.stack([x, y, 60 + 0.3 * np.sin(0.7 * k), 80 + 0.4 * np.sin(0.7 * k)], 1)


def build_run(*events, off_target=(), **parameters):
    """Return a run that declared `events`: first frame, last frame, and frame of return or None.

    In the frames `off_target`, boxes are 100 px off the target. `parameters` are of the tracker.
    """
    target = true_boxes()
    online, revised = target.copy(), target.copy()
    online[list(off_target), 0] += 100
    revised[list(off_target), 0] += 100
    for beginning, end, back in events:
        ahead = np.arange(1, N + 1)[:, None] * (target[beginning - 1] - target[beginning - 2])
        online[beginning:back] = (revised[beginning - 1] + ahead)[: len(online[beginning:back])]
        if back is None:  # only the boxes show the end of the occlusion
            revised[beginning:] = online[beginning:]
        if back is None and end is not None:
            revised[end:] = target[end:]
            steps = end - beginning + 2
            revised[beginning - 1 : end + 1] = np.linspace(
                revised[beginning - 1], target[end], steps
            )
    details = _details(events)
    return Run(
        identity=SimpleNamespace(
            parameters={"longest_occlusion": 35, "candidates": "skipped", **parameters}
        ),
        boxes=online,
        visible=details["occluded"] != 1,
        confidence=np.full(N, np.nan),
        details=details,
        revised=revised if events else None,
    )


def _details(events):
    """Return the details that the tracker reports for these occlusions."""
    diary, rows, spans, declared_until = OcclusionLog(), [], [], 0
    for beginning, end, back in events:
        # The tracker declares an occlusion after its return from an earlier one.
        spans.append((max(beginning, declared_until), N if back is None else back, beginning, end))
        declared_until = spans[-1][1]
    for frame in range(1, N):
        occluded, candidate = 0.0, np.nan
        for declared, last, beginning, end in spans:
            if frame == declared:
                diary.record_beginning(beginning)
            if frame == last:
                diary.record_end(end)
            if declared <= frame < last:
                occluded, candidate = 1.0, np.nan if end is None else end
        rows.append({"occluded": occluded, "candidate": candidate, **diary.next_events()})
    return {name: np.r_[np.nan, values] for name, values in pd.DataFrame(rows).items()}


def build_truth(*hidden, visible=0.0, off=None):
    """Return the ground truth of the target, hidden in frame ranges that include their ends.

    The lamp is off from frame `off[0]` to before frame `off[1]`.
    """
    visibility, attributes = np.ones(N), {}
    for first, last in hidden:
        visibility[first : last + 1] = visible
    if off is not None:
        attributes["lamp off"] = (np.arange(N) >= off[0]) & (np.arange(N) < off[1])
    return StoredTruth("made", "", true_boxes(), {}, visibility, attributes, 25.0)
