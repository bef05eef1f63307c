"""Scores of the paper's runs with known values."""

from functools import cache

import numpy as np
import pandas as pd
import pytest

from bench.evaluation.record import Run
from bench.papers.wang2010.courses import CUP, HAND, TABLE_TENNIS, course_of
from bench.papers.wang2010.scores import labels_of
from bench.store.truth import StoredTruth

LENGTHS = {TABLE_TENNIS: 50, HAND: 100, CUP: 80}
USUAL = {
    TABLE_TENNIS: (
        "wang2010:preset=as-written",
        "particle-filter:preset=as-written",
        "camshift",
        "camshift:window=adaptive",
    ),
    HAND: (
        "wang2010:preset=as-written",
        "camshift",
        "camshift:window=adaptive",
        "camshift-improved:preset=as-written",
        "camshift-improved:preset=as-written:window=adaptive",
    ),
    CUP: (
        "wang2010:preset=as-written:particles=15",
        "wang2010:preset=as-written:particles=15:alpha=1:beta=0",
        "wang2010:preset=as-written:particles=15:beta=0",
    ),
}


@pytest.fixture(scope="session")
def made_scores():
    """Makes scores: of `texts` by sequence, with errors by frame that `errors` gives.

    `errors` is called with the tracker's text, sequence and scene, and gives an error of all
    frames or one a frame; the tolerance is 6 pixels.
    """

    labels_by_text = cache(labels_of)

    def make(errors, texts=None, scenes=20, repetitions=1, **details):
        rows = []
        for sequence, trackers in (texts or USUAL).items():
            for text in trackers:
                for scene in range(scenes):
                    for repetition in range(repetitions):
                        course = _course(sequence, errors(text, sequence, scene), details)
                        rows.append(
                            {
                                "text": text,
                                "name": f"{sequence}:scene={scene}",
                                "sequence": sequence,
                                "scene": scene,
                                "light": "even",
                                "repetition": repetition,
                                "frames": LENGTHS[sequence],
                                "success_frames": 1,
                                "frames_inside": 1,
                                "first_loss": 1,
                                "mean_overlap": 0.5,
                                "path": "",
                                "failure": "",
                                "kept_scene": True,
                            }
                            | labels_by_text(text, sequence)
                            | course
                        )
        return pd.DataFrame(rows)

    return make


def _course(sequence, errors, details):
    number = LENGTHS[sequence]
    boxes = np.tile([10.0, 20.0, 12.0, 12.0], (number, 1))
    if sequence == HAND:
        boxes[49:, 0] -= 40.0  # away from the face: what is 40 pixels beside it is on the face
    estimate = boxes.copy()
    estimate[:, 0] += errors
    truth = StoredTruth(sequence, boxes, {}, np.ones(number), {}, 25.0)
    run = Run(
        identity=None,
        boxes=estimate,
        visible=np.ones(number, bool),
        confidence=np.full(number, np.nan),
        details={name: np.full(number, value) for name, value in details.items()},
    )
    known = course_of(run, truth, sequence)
    return known | {"centre_error": float(np.mean(np.broadcast_to(errors, number)))}
