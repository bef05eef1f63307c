"""Occlusions that a run declared are read from its boxes and details."""

from collections import Counter

import numpy as np
import pytest

import bench
import datasets
from bench.papers.nguyen2002.events import Declared, Hidden, declared_in, hidden_in
from tests.trackers.plain_nguyen2002 import track_offline


def test_an_occlusion_is_what_the_tracker_tells_of_it_whatever_its_boxes_are(made_run):
    for events in ([(30, 49, 65)], [(20, 25, 55), (70, 81, 105)], []):
        assert declared_in(made_run(*events)) == [Declared(*event) for event in events]
    straight = made_run((30, 41, 65), (80, 85, 115))
    straight.revised[1:] = straight.revised[0] + np.arange(1, 120)[:, None]
    assert declared_in(straight) == [Declared(30, 41, 65), Declared(80, 85, 115)]


@pytest.mark.parametrize(
    "events",
    [
        [(20, 31, 55), (40, 59, 75)],
        [(20, 25, 55), (30, 37, 55), (38, 43, 55), (50, 57, 57)],
        [(20, 25, 55), (54, 59, 60), (60, 65, 65)],
    ],
)
def test_occlusions_that_were_met_while_catching_up_are_others(made_run, events):
    assert declared_in(made_run(*events)) == [Declared(*event) for event in events]


def test_what_was_open_at_the_sequences_end_ends_at_its_candidate(made_run):
    assert declared_in(made_run((100, 111, None))) == [Declared(100, 111, None)]
    assert declared_in(made_run((117, None, None))) == [Declared(117, None, None)]
    assert declared_in(made_run((119, None, None))) == [Declared(119, None, None)]
    nested = [(70, 81, 105), (90, 95, None)]
    assert declared_in(made_run(*nested)) == [Declared(*event) for event in nested]
    on_the_line = made_run((100, 105, None))
    on_the_line.revised[100:] = on_the_line.revised[99] + np.arange(1, 21)[:, None]
    assert declared_in(on_the_line)[0] == Declared(100, 105, None)


def test_what_begins_after_an_occlusion_that_the_sequences_end_closed_is_told_by_boxes(made_run):
    run = made_run((86, 91, None))
    run.revised[95:] = made_run((100, 107, None)).revised[95:]
    assert declared_in(run) == [Declared(86, 91, None), Declared(100, 107, None)]
    more = made_run((86, 91, None), candidates="all")
    more.revised[95:] = made_run((100, 109, None)).revised[95:]
    assert declared_in(more) == [Declared(86, 91, None), Declared(100, 109, None)]
    long = made_run((10, 17, None), longest_occlusion=67)
    long.revised[18:] = made_run((20, 87, None)).revised[18:]
    assert declared_in(long) == [Declared(10, 17, None), Declared(20, 87, None)]


def test_what_the_sequences_end_left_no_frame_to_tell_is_told_by_boxes(made_run):
    told = [(80, 91, 119), (95, 106, 119), (107, 112, 119)]
    run = made_run(*told)
    for beginning, end, _ in told[1:]:
        run.revised[beginning : end + 1] = made_run((beginning, end, None)).revised[
            beginning : end + 1
        ]
    assert declared_in(run) == [Declared(*event) for event in told]


PLAIN = "plain/target:length=60:occlusion=0.9:noise=8"
"""By a low limit of outliers noise is taken for occlusions: they follow on one another."""


def events_of_both(text, length=60):
    """Occlusions of a run that have an end, by its rows and by the method in plain NumPy."""
    sequence = datasets.load(PLAIN)[:length]
    run = bench.evaluate(f"nguyen2002:{text}", sequence)
    assert not run.failure
    settings = run.identity.parameters
    _, expected, _ = track_offline(list(sequence), sequence.boxes[0], **settings)
    events = declared_in(run)
    found = [event[:2] for event in events if event.end is not None]
    return events, found, [event for event in expected if event[1] < len(sequence)]


@pytest.mark.parametrize(
    ("text", "length", "together"),
    [
        ("longest_occlusion=11:search_range=8", 40, 2),
        pytest.param("longest_occlusion=19", 60, 3, marks=pytest.mark.slow),
    ],
)
def test_occlusions_that_began_and_ended_within_what_was_looked_through_are_not_lost(
    text, length, together
):
    text = f"features=rgb:end=first:gamma=0.08:{text}"
    events, found, expected = events_of_both(text, length)
    assert found == expected
    assert max(Counter(event.back for event in events if event.back).values()) == together


def test_events_are_frames_of_the_sequence_also_where_the_target_comes_later():
    sequence = datasets.load(PLAIN)
    boxes = sequence.boxes.copy()
    boxes[:5] = np.nan
    sequence.boxes = boxes
    run = bench.evaluate("nguyen2002:features=rgb:longest_occlusion=11", sequence)
    first = np.flatnonzero(run.details["occluded"] == 1)[0]
    event = declared_in(run)[0]
    assert event.beginning == first
    changed = (run.revised != run.boxes).any(axis=1)
    assert changed[first]
    assert not changed[5:first].any()


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "features=rgb:gamma=0.08:longest_occlusion=11",
        "features=rgb:gamma=0.05:longest_occlusion=11",
        "features=invariants:gamma=0.2:longest_occlusion=11",
        "features=intensity:gamma=0.02:longest_occlusion=11",
        "features=intensity:gamma=0.02:longest_occlusion=19:end=first:accept=0",
        "features=rgb:gamma=0.05:end=first:accept=0.04",
        "preset=robust:gamma=0.05:accept=0.06:candidates=all",
        "preset=as-written:gamma=0.1:longest_occlusion=11",
    ],
)
def test_events_of_stored_runs_are_those_of_the_method_in_plain_numpy(text):
    _, found, expected = events_of_both(text)
    assert len(found) > 1
    assert found == expected


def test_only_stretches_with_hardly_anything_in_view_are_complete_occlusions():
    visibility = np.ones(40)
    visibility[5:10] = 0.5
    visibility[15:21] = (0.8, 0.3, 0.0, 0.02, 0.4, 0.89)
    visibility[30:32] = (0.02, 0.7)
    assert hidden_in(visibility) == [Hidden(15, 20), Hidden(30, 31)]
    assert hidden_in(np.ones(9)) == []


def test_an_event_belongs_to_an_occlusion_from_two_frames_before_it_to_its_last():
    hidden = Hidden(20, 30)
    found = [hidden.causes(Declared(frame, None, None)) for frame in (17, 18, 30, 31)]
    assert found == [False, True, True, False]
