"""Occlusions that a run declared are read from its boxes and details."""

import numpy as np
import pytest

from tests.bench.papers.nguyen2002.runs import build_run
from tests.trackers.references.nguyen2002 import track_offline
from trackmark import datasets
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.papers.nguyen2002.events import Declared, Hidden, declared_in, hidden_in


@pytest.mark.parametrize(
    "events",
    [
        [],
        [(30, 49, 65)],
        [(20, 25, 55), (70, 81, 105)],
        # Found while the tracker processes skipped frames.
        [(20, 31, 55), (40, 59, 75)],
        [(20, 25, 55), (30, 37, 55), (38, 43, 55), (50, 57, 57)],
        [(20, 25, 55), (54, 59, 60), (60, 65, 65)],
        # Open at the end of the sequence.
        [(100, 111, None)],
        [(117, None, None)],
        [(119, None, None)],
        [(70, 81, 105), (90, 95, None)],
    ],
)
def test_events_are_those_that_the_tracker_reports(events):
    assert declared_in(build_run(*events)) == [Declared(*event[:2]) for event in events]


@pytest.mark.parametrize("events", [[(30, 41, 65), (80, 85, 115)], [(100, 105, None)]])
def test_events_do_not_depend_on_boxes_in_equal_steps(events):
    run, first = build_run(*events), events[0][0] - 1
    run.revised[first:] = run.revised[first] + np.arange(120 - first)[:, None]
    assert declared_in(run)[: len(events)] == [Declared(*event[:2]) for event in events]


@pytest.mark.parametrize(
    ("parameters", "events"),
    [
        ({}, [(86, 91, None), (100, 107, None)]),
        ({"candidates": "all"}, [(86, 91, None), (100, 109, None)]),
        ({"longest_occlusion": 67}, [(10, 17, None), (20, 87, None)]),
    ],
)
def test_occlusion_after_an_open_one_is_inferred_from_boxes(parameters, events):
    first, second = events
    run = build_run(first, **parameters)
    run.revised[second[0] - 2 :] = build_run(second).revised[second[0] - 2 :]
    assert declared_in(run) == [Declared(*event[:2]) for event in events]


def test_unreported_occlusions_are_inferred_from_boxes():
    events = [(80, 91, 119), (95, 106, 119), (107, 112, 119)]
    run = build_run(*events)
    for beginning, end, _ in events[1:]:
        hidden = slice(beginning, end + 1)
        run.revised[hidden] = build_run((beginning, end, None)).revised[hidden]
    assert declared_in(run) == [Declared(*event[:2]) for event in events]


PLAIN = "plain/target:length=60:occlusion=0.9:noise=8"
"""Sequence with noise: a low outlier limit declares many occlusions in a row."""


@pytest.mark.slow
def test_events_are_frames_of_the_sequence_of_a_late_target():
    sequence = datasets.load(PLAIN)
    boxes = sequence.boxes.copy()
    boxes[:5] = np.nan
    sequence.boxes = boxes
    run = evaluate_run("nguyen2002:features=rgb:longest_occlusion=11", sequence)
    first = np.flatnonzero(run.details["occluded"] == 1)[0]
    event = declared_in(run)[0]
    assert event.beginning == first
    changed = (run.revised != run.boxes).any(axis=1)
    assert changed[first]
    assert not changed[5:first].any()


FIRST = "features=rgb:end=first:gamma=0.06"


@pytest.mark.parametrize(
    ("text", "length"),
    [
        (f"{FIRST}:longest_occlusion=11:search_range=8", 40),
        pytest.param(f"{FIRST}:longest_occlusion=19", 60, marks=pytest.mark.slow),
        pytest.param(
            "features=rgb:end=first:gamma=0.05:accept=0.06:candidates=all",
            60,
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "preset=as-written:gamma=0.1:longest_occlusion=11", 60, marks=pytest.mark.slow
        ),
    ],
)
def test_events_of_stored_runs_equal_those_of_plain_numpy(text, length):
    sequence = datasets.load(PLAIN)[:length]
    run = evaluate_run(f"nguyen2002:{text}", sequence)
    _, expected, _ = track_offline(list(sequence), sequence.boxes[0], **run.identity.parameters)
    ended = [event for event in declared_in(run) if event.end is not None]
    assert len(ended) > 1
    assert ended == [event for event in expected if event[1] < length]


def test_complete_occlusion_has_hardly_anything_in_view():
    visibility = np.ones(40)
    visibility[5:10] = 0.5
    visibility[15:21] = (0.8, 0.3, 0.0, 0.02, 0.4, 0.89)
    visibility[30:32] = (0.02, 0.7)
    assert hidden_in(visibility) == [Hidden(15, 20), Hidden(30, 31)]
    assert hidden_in(np.ones(9)) == []


def test_event_may_begin_two_frames_before_the_occlusion():
    hidden = Hidden(20, 30)
    causes = [hidden.causes(Declared(frame, None)) for frame in (17, 18, 30, 31)]
    assert causes == [False, True, True, False]
