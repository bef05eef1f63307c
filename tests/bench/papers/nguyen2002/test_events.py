"""Occlusions that a run declared are read from its boxes and details."""

import numpy as np
import pytest

import bench
import datasets
from bench.papers.nguyen2002.events import Declared, Hidden, declared_in, hidden_in
from bench.papers.nguyen2002.plain import track_offline


def test_an_occlusion_begins_where_boxes_were_revised_and_ends_where_they_leave_the_line(made_run):
    for events in ([(30, 49, 65)], [(20, 25, 55), (70, 81, 105)], []):
        assert declared_in(made_run(*events)) == [Declared(*event) for event in events]


def test_an_occlusion_that_was_met_while_catching_up_is_another(made_run):
    events = [(20, 31, 55), (40, 59, 75)]
    assert declared_in(made_run(*events)) == [Declared(*event) for event in events]


def test_the_end_is_a_frame_that_was_visited(made_run):
    """A target at rest stays on the line after the end."""
    events = [(30, 52, 65)]
    assert declared_in(made_run(*events)) == [Declared(30, 49, 65)]
    assert declared_in(made_run(*events, candidates="all")) == [Declared(*events[0])]
    assert declared_in(made_run((20, 87, 90), longest_occlusion=67)) == [Declared(20, 87, 90)]
    assert declared_in(made_run((20, 87, 90))) == [Declared(20, 55, 90)]


def test_what_was_open_at_the_sequences_end_is_told_by_revised_boxes_alone(made_run):
    assert declared_in(made_run((100, 111, None))) == [Declared(100, 111, None)]
    assert declared_in(made_run((117, None, None))) == [Declared(117, None, None)]
    assert declared_in(made_run((119, None, None))) == [Declared(119, None, None)]
    nested = [(70, 81, 105), (90, 95, None)]
    assert declared_in(made_run(*nested)) == [Declared(*event) for event in nested]


def test_what_begins_after_an_occlusion_that_the_sequences_end_closed_is_found(made_run):
    run = made_run((86, 91, None))
    later = made_run((100, 107, None))
    run.revised[95:] = later.revised[95:]
    assert declared_in(run) == [Declared(86, 91, None), Declared(100, 107, None)]


@pytest.mark.slow
@pytest.mark.parametrize("text", ["rgb:gamma=0.08", "invariants:gamma=0.2", "intensity:gamma=0.02"])
def test_events_of_stored_runs_are_those_of_the_method_in_plain_numpy(text):
    sequence = datasets.load("plain/target:length=60:occlusion=0.9:noise=8")
    features, _, gamma = text.partition(":gamma=")
    run = bench.evaluate(f"nguyen2002:features={text}:longest_occlusion=11", sequence)
    images = [sequence[frame] for frame in range(len(sequence))]
    _, expected = track_offline(
        images, sequence.boxes[0], features=features, gamma=float(gamma), longest_occlusion=11
    )
    found = [(event.beginning, event.end) for event in declared_in(run) if event.end is not None]
    assert len(found) > 1
    assert found == [(first, end) for first, end in expected if end < len(images)]


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
