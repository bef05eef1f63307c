"""State of the process that trackers of a pass share, which late draws and folders change."""

import os
import random
from pathlib import Path

import cv2
import numpy as np
import pytest

from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.trackers import Estimate


class Still:
    """Tracker that calls `act` in each update; `frames` are those of all objects."""

    def __init_subclass__(cls):
        cls.frames = []

    def __init__(self, seed):
        self.frame = 0

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        self.frame += 1
        self.frames.append(self.frame)
        step = self.act() or 0.0
        return Estimate(self.box + [step, 0, 0, 0])

    def act(self):
        return 0.0


def opencv():
    number = np.zeros((1, 1))
    cv2.randn(number, 0, 1)
    return number.item()


DRAWS = {
    "random": random.random,
    "numpy.random": np.random.random,
    "OpenCV": opencv,
}


def late(draw, frame):
    """Return a tracker that draws from a frame on."""

    class Late(Still):
        def act(self):
            return draw() if self.frame >= frame else 0.0

    return Late


def run(sequence, *trackers):
    return run_protocol([(parse_tracker(tracker), 0) for tracker in trackers], sequence).runs


@pytest.mark.parametrize("name", DRAWS)
@pytest.mark.parametrize("frame", [6, 19])
def test_late_draws_have_numbers_of_their_run_only(make_sequence, name, frame):
    sequence, tracker = make_sequence(n=20), late(DRAWS[name], frame)
    (alone,) = run(sequence, tracker)
    assert alone.metadata["generators"] == [name]
    assert alone.boxes[-1, 0] != sequence.boxes[0, 0]
    others = run(sequence, late(DRAWS[name], 1), tracker, late(DRAWS[name], 7))
    np.testing.assert_array_equal(others[1].boxes, alone.boxes)


def test_pass_is_repeated_after_late_draws_only(make_sequence):
    class Calm(Still):
        pass

    run(make_sequence(n=20), Calm)
    assert len(Calm.frames) == 19
    for frame, updates in ((1, 19), (6, 7 + 19), (19, 19 + 19)):
        tracker = late(random.random, frame)
        run(make_sequence(n=20), tracker)
        assert len(tracker.frames) == updates


def test_late_change_of_folder_is_kept_from_others(make_sequence, tmp_path):
    home = Path.cwd()

    class Moves(Still):
        def act(self):
            if self.frame == 10:
                os.chdir(tmp_path)
            assert (Path.cwd() == tmp_path) == (self.frame >= 10)

    class Stays(Still):
        def act(self):
            assert Path.cwd() == home

    runs = run(make_sequence(n=20), Moves, Stays)
    assert [entry.failure for entry in runs] == ["", ""]
    assert "generators" not in runs[0].metadata
    assert Path.cwd() == home


def test_copy_of_the_process_ends_in_each_call(make_sequence):
    """The copy does not return to the harness, also without contexts and in `finish`."""
    harness, copies = os.getpid(), []

    class Forks(Still):
        def act(self):
            if self.frame == 10:
                self.fork()

        def finish(self):
            self.fork()
            return {}

        def fork(self):
            if copy := os.fork():
                copies.append(copy)

    (result,) = run(make_sequence(n=20), Forks)
    if os.getpid() != harness:
        os._exit(99)  # a copy must not get here
    assert not result.failure
    codes = [os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]) for copy in copies]
    assert codes == [0, 0]


def test_error_after_change_of_folder_is_no_error_of_sequence(make_sequence, tmp_path):
    sequence, home = make_sequence(n=20), Path.cwd()
    frames = sequence.frames

    class Relative:
        def __len__(self):
            return len(frames)

        def __getitem__(self, frame):
            if Path.cwd() != home:
                raise FileNotFoundError
            return frames[frame]

    class Moves(Still):
        def act(self):
            os.chdir(tmp_path)

    class MovesLate(Moves):
        def act(self):
            if self.frame > 5:
                super().act()

    sequence.frames = Relative()
    assert [entry.failure for entry in run(sequence, Moves)] == [""]
    assert [entry.failure for entry in run(sequence, MovesLate)] == [""]
