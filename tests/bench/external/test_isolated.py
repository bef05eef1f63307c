"""Trackers of the full interface in processes of their own: equal to those in this process."""

import time

import cv2
import numpy as np
import pytest

from trackmark import trackers
from trackmark.bench.evaluation.loop import run_protocol
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.experiments.tracker_spec import TrackerSpec
from trackmark.bench.external import isolated, process
from trackmark.bench.external.isolated import describe_isolated, open_isolated
from trackmark.trackers import Randomness, TrackerError

FULL = '''
import os, random, sys, time
import numpy as np
from pydantic import Field
from trackmark.trackers import Estimate, Parameters, Randomness, TrackerPlugin

class FullParameters(Parameters):
    step: float = Field(1.0, gt=0, description="step [px]")

class Full(TrackerPlugin):
    """Use each part of the interface."""
    randomness = Randomness.GENERATOR
    Parameters = FullParameters
    presets = {"fast": {"step": 2.5}}

    def __init__(self, parameters, seed):
        super().__init__(parameters, seed)
        self.generator, self.n, self.seen = np.random.default_rng(seed), 0, 0.0

    def watch(self, image):
        self.seen += image.mean()

    def init(self, image, box, mask=None):
        self.box, self.has_mask = box, mask is not None

    def update(self, image):
        self.n += 1
        ACT
        step = self.parameters.step * self.generator.random() + random.random() + np.random.rand()
        self.box = self.box + [step, image.mean() / 99, 0, 0]
        return Estimate(
            self.box,
            confidence=0.5,
            mask=np.arange(image[..., 0].size).reshape(image.shape[:2]) % 3 == 0,
            details={"seen": self.seen, "masked": float(self.has_mask)},
            arrays={"points": self.generator.random((5, 2)), "steps": np.arange(3)},
            revised={np.int64(self.n - 1): self.box + 1},
        )

    def maps(self, image):
        return {"weight": image[..., 0] / 255}

    def finish(self):
        return {0: np.array([1.0, 2, 3, 4])}
'''


@pytest.fixture
def write(tmp_path):
    """Write the file of a tracker, with a statement in each update."""

    def write_file(act="pass"):
        file = tmp_path / "full.py"
        file.write_text(FULL.replace("ACT", act))
        return str(file)

    return write_file


def spec(name, options, make):
    selected = trackers.resolve(name, **options)
    return TrackerSpec(
        selected.name,
        selected.name,
        selected.preset,
        {},
        selected.randomness,
        make or selected.create,
        None,
        {},
    )


def run(name, options, sequence, *, is_isolated, **more):
    make = open_isolated(name, options)[0] if is_isolated else None
    entry = spec(name, options, make), 2
    (result,) = run_protocol([entry], sequence, keep_arrays=True, **more).runs
    return result


def content(result: Run):
    arrays = {
        (frame, name): (array.dtype, array.tobytes())
        for frame, named in result.arrays.items()
        for name, array in named.items()
    }
    revised = None if result.revised is None else result.revised.tobytes()
    details = {name: values.tobytes() for name, values in result.details.items()}
    values = result.boxes, result.visible, result.confidence
    return result.failure, [*map(np.ndarray.tobytes, values)], details, revised, arrays


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("full.py", {"preset": "fast"}),
        ("full.py", {"step": "0.125", "as": "mine"}),
        ("opencv-tld", {}),
        ("particle-filter", {"particles": "20"}),
    ],
)
def test_run_in_a_process_equals_one_in_this_process(make_sequence, write, name, options):
    """The file uses masks, arrays, maps, revised boxes, seeds, `watch` and `finish`."""
    if name == "opencv-tld" and not hasattr(getattr(cv2, "legacy", cv2), "TrackerTLD_create"):
        pytest.skip("OpenCV has no TLD")
    name = write() if name == "full.py" else name
    sequence = make_sequence(n=12, absent=(0, 1))
    in_process, isolated_run = (
        run(name, options, sequence, is_isolated=is_isolated) for is_isolated in (False, True)
    )
    assert not in_process.failure
    assert content(isolated_run) == content(in_process)
    assert isolated_run.metadata.get("generators") == in_process.metadata.get("generators")


def test_process_computes_in_one_thread_of_opencv(make_sequence, write):
    name = write("import cv2; assert cv2.getNumThreads() == 1")
    assert not run(name, {}, make_sequence(n=3), is_isolated=True).failure


def test_description_is_that_of_this_process(write):
    file = write()
    _, fields = open_isolated(file, {"preset": "fast"})
    assert fields["name"] == "full.py:Full"
    assert fields["parameters"] == {"step": 2.5}
    assert fields["options"] == {"preset": "fast"}
    assert Randomness(fields["randomness"]) is Randomness.GENERATOR
    assert describe_isolated(file) == trackers.describe(file)


FAILURES = {
    "raise ValueError('no\\n target')": "ValueError: no  target",
    "return 5": "update returned 5. Expected: an Estimate",
    "open(os.environ['HANGS'], 'w'); time.sleep(99)": "did not answer in 60 s. Its last call: ",
}


@pytest.mark.parametrize("act", FAILURES)
def test_failure_has_frame_reason_and_last_output(make_sequence, write, hangs, act):
    name = write(f"\n        if self.n == 3: print('last words', flush=True); {act}")
    sequence = make_sequence(n=8)
    result = run(name, {}, sequence, is_isolated=True)
    reason, _, trace = result.failure.partition("\n")
    assert reason.startswith(f"{sequence.frame_name(3)}: ")
    assert FAILURES[act] in reason
    assert "last words" in trace or "Expected" in reason
    assert np.isfinite(result.boxes[:, 0]).sum() == 3
    hangs.unlink(missing_ok=True)
    assert not run(write(), {}, sequence, is_isolated=True).failure


def test_process_of_multiprocessing_is_no_copy(make_sequence, write):
    kind = "__import__('multiprocessing').get_context('fork').Process"
    start = f"{kind}(target=time.sleep, args=(99,), daemon=True).start()"
    name = write(f"\n        if self.n == 3: {start}")
    assert not run(name, {}, make_sequence(n=8), is_isolated=True).failure


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os; os._exit(0)", "the import failed: the process ended with status 0"),
        ("import sys; sys.exit(0)", r"the file cannot be imported: SystemExit: 0 \(line 1\)"),
        ("raise KeyboardInterrupt", "its description raises KeyboardInterrupt"),
        ("while True: pass", "the import failed: the process did not answer in 0.2 s"),
    ],
)
def test_error_of_an_import_names_the_file(write, tmp_path, monkeypatch, code, words):
    file = tmp_path / "bad.py"
    file.write_text(code)
    if "while" in code:
        monkeypatch.setattr(isolated, "START_SECONDS", 0.2)
        monkeypatch.setattr(process, "monotonic", time.monotonic)
    with pytest.raises(TrackerError, match=rf"bad\.py: {words}"):
        open_isolated(str(file), {})
