"""Loop over frames: calls, estimates, and failures of trackers."""

import numpy as np
import pytest

import trackmark as tm
from tests.bench.evaluation.walkers import Walker, misbehaving
from trackmark.bench.evaluation.loop import evaluate_run, run_protocol
from trackmark.bench.evaluation.recorder import Observer
from trackmark.bench.experiments.tracker_spec import parse_tracker
from trackmark.bench.protocols import ONE_PASS, TIMING
from trackmark.datasets import SequenceError
from trackmark.trackers import Estimate
from trackmark.trackers.base.sharing import SharingTracker


def test_tracker_starts_with_the_target_and_sees_later_frames(make_sequence):
    created_trackers = []

    def maker(seed):
        created_trackers.append(Walker(seed))
        return created_trackers[-1]

    sequence = make_sequence(n=8, absent=(0, 1, 5))
    run = evaluate_run(maker, sequence)
    assert created_trackers[0].shown == [int(sequence[i].sum()) for i in range(2, 8)]
    assert np.isnan(run.boxes[:2]).all()
    np.testing.assert_array_equal(run.boxes[2], sequence.boxes[2])
    assert np.isfinite(run.boxes[3:]).all()
    assert run.visible.tolist() == [False] * 2 + [True] * 6
    np.testing.assert_allclose(
        run.details["brightness"][3:], [sequence[i].mean() for i in range(3, 8)]
    )
    assert np.isnan(run.details["brightness"][:3]).all()


def test_frame_is_read_once_for_all_trackers(make_sequence):
    sequence = make_sequence(n=6)
    frames = sequence.frames
    sequence.check_runnable()
    frames.requested.clear()
    run_protocol([(parse_tracker(Walker), r) for r in range(4)], sequence)
    fetched = [frame for frame in frames.requested if frame > 0]
    assert fetched == [1, 2, 3, 4, 5]


computed = []


def costly(image, power):
    computed.append(power)
    return (image.astype(np.int64) ** power).sum()


class Sharer(SharingTracker):
    """Tracker that moves by a value shared with other trackers."""

    def init_shared(self, frame, box, mask=None):
        self.box = box

    def update_shared(self, frame):
        self.box = self.box + [float(frame.compute(costly, 2) % 3), 0, 0, 0]
        return Estimate(self.box)


def make_sharer(seed):
    return Sharer(Sharer.Parameters(), seed)


def test_shared_work_is_done_once_per_frame(make_sequence):
    sequence = make_sequence(n=5)
    entry = parse_tracker(make_sharer)
    computed.clear()
    runs = run_protocol([(entry, 0), (entry, 1)], sequence).runs
    assert len(computed) == 4
    np.testing.assert_array_equal(runs[0].boxes, runs[1].boxes)
    (unshared,) = run_protocol([(entry, 0)], sequence, TIMING).runs
    np.testing.assert_array_equal(runs[0].boxes, unshared.boxes)


@pytest.mark.parametrize("n", [1, 3])
def test_shared_frame_has_the_number_of_trackers(make_sequence, n):
    sharer_counts = set()

    class Asker(Sharer):
        def update_shared(self, frame):
            sharer_counts.add(frame.sharers)
            return Estimate(self.box)

    entry = parse_tracker(lambda seed: Asker(Asker.Parameters(), seed))
    run_protocol([(entry, repetition) for repetition in range(n)], make_sequence(4))
    assert sharer_counts == {n}


def raise_error(image, tracker):
    raise ZeroDivisionError("of my own making")


def test_progress_follows_the_initialisation_and_each_update(make_sequence):
    events = []

    class Noting(Observer):
        def on_frame(self, frame, n_done):
            events.append((frame, n_done))

        def on_tracker_return(self, run_index, seconds):
            events.append(seconds)

    run_protocol([(parse_tracker("static"), 0)], make_sequence(n=3), observer=Noting())
    assert [event for event in events if isinstance(event, tuple)] == [
        (0, 0),
        (0, 1),
        (1, 2),
        (2, 3),
    ]
    assert [isinstance(event, tuple) for event in events] == [True, False] * 3 + [True]


def test_ctrl_c_is_not_a_failure_of_the_tracker(make_sequence):
    def interrupt(image, tracker):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate_run(misbehaving(interrupt), make_sequence())


def test_negative_repetition_is_refused(make_sequence):
    with pytest.raises(ValueError, match="repetition is -1"):
        evaluate_run(Walker, make_sequence(), -1)


def test_tracker_without_a_file_runs(make_sequence):
    names = {"Walker": Walker}
    exec(compile("make = lambda seed: Walker(seed)", "<stdin>", "exec"), names)
    assert evaluate_run(names["make"], make_sequence()).status == "finished"


def test_identity_is_computed_before_the_run(make_sequence, tmp_path):
    file = tmp_path / "editing.py"
    file.write_text(
        "from pathlib import Path\n"
        "from trackmark.trackers import Estimate, TrackerPlugin\n"
        "class Editing(TrackerPlugin):\n"
        "    def init(self, image, box, mask=None):\n"
        "        self.box = box\n"
        "    def update(self, image):\n"
        "        Path(__file__).write_text(Path(__file__).read_text() + '0\\n')\n"
        "        return Estimate(self.box)\n"
    )
    before = parse_tracker(f"{file}:Editing").version
    run = evaluate_run(f"{file}:Editing", make_sequence())
    assert run.identity.tracker_code == before
    assert parse_tracker(f"{file}:Editing").version != before


def test_tracker_that_cannot_be_created_is_a_failed_run(make_sequence):
    def unmakeable(seed):
        raise RuntimeError("no licence")

    run = evaluate_run(unmakeable, make_sequence())
    assert run.failure.startswith("frame 0: RuntimeError: no licence")
    assert "Traceback" in run.failure
    with pytest.raises(ValueError, match="no licence"):
        tm.score(run, make_sequence())


@pytest.mark.parametrize("protocol", [ONE_PASS, TIMING])
def test_frame_of_another_size_is_an_error(make_sequence, protocol):
    sequence = make_sequence(n=8)
    sequence.frames = [np.zeros((24, 32 + (frame == 5), 3), np.uint8) for frame in range(8)]
    with pytest.raises(
        SequenceError, match="line: frame 5 has 33x24 pixels, other images have 32x24"
    ):
        run_protocol([(parse_tracker("static"), 0)], sequence, protocol)


def test_arrays_and_masks_are_kept_on_request(make_sequence):
    def draw(image, tracker):
        mask = np.ones(image.shape[:2], bool)
        return Estimate(tracker.box, mask=mask, arrays={"cloud": np.arange(3)})

    maker = misbehaving(draw)
    assert evaluate_run(maker, make_sequence()).arrays == {}
    arrays = evaluate_run(maker, make_sequence(), keep_arrays=True).arrays
    assert list(arrays) == [3]
    np.testing.assert_array_equal(arrays[3]["cloud"], [0, 1, 2])
    assert arrays[3]["mask"].all()


def test_tracker_instance_is_refused(make_sequence):
    with pytest.raises(TypeError, match="seed is unknown"):
        evaluate_run(Walker(0), make_sequence())


def test_sequence_without_ground_truth_is_refused(make_sequence):
    sequence = make_sequence(n=4, absent=range(4))
    with pytest.raises(SequenceError, match="no ground truth"):
        evaluate_run("static", sequence)
