"""Server of TraX: our trackers, driven by our client and by vot-toolkit."""

import io
import os
import re
import shlex
import subprocess
import sys
import venv
from contextlib import nullcontext

import cv2
import numpy as np
import pytest

from tests.bench.external.conftest import HOME, living
from trackmark import datasets, trackers
from trackmark.bench.external.definition import open_external
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.external.trax import format_message, parse_message
from trackmark.bench.external.trax_server import serve_client
from trackmark.bench.external.worker_process import WORKER
from trackmark.trackers import TrackerError

COMMAND = [sys.executable, "-c", "from trackmark.bench.cli import main; main()", "trax"]


def start(*arguments):
    command = shlex.join([*COMMAND, *map(str, arguments)])
    return open_external("trax", {"command": command, "folder": str(HOME), "as": "x"}).create()


@pytest.mark.parametrize(
    "name", ["camshift", pytest.param("particle-filter", marks=pytest.mark.slow)]
)
def test_estimates_equal_those_in_process_to_the_bit(name):
    sequence = datasets.load("samples/face")
    served = start(name, "--seed", 7)
    assert served.process.hello["trax.name"] == name
    for seed in (7, 8):  # a client initialises again after a failure of the tracker
        local = trackers.create(name, seed=seed)
        for tracker in (served, local):
            tracker.init(sequence[0], sequence.boxes[0] + 0.1)
        for frame in range(1, 30):
            remote, expected = (tracker.update(sequence[frame]) for tracker in (served, local))
            assert remote.box.tolist() == expected.box.tolist()
            assert remote.confidence == pytest.approx(expected.confidence, abs=0, nan_ok=True)
    served.close()
    assert served.process.process.returncode == 0


DRAWING = """
import random
import numpy as np

class Drawing:
    def init(self, image, box):
        self.box = box

    def update(self, image):
        return [*self.box[:2] + np.random.rand(2), 3 + random.random(), 4]
"""


@pytest.mark.slow
def test_seed_sets_global_random_generators(tmp_path):
    (tmp_path / "drawing.py").write_text(DRAWING)
    image, boxes = np.zeros((9, 9, 3), np.uint8), []
    for seed in (7, 7, 8):
        served = start(tmp_path / "drawing.py", "--seed", seed)
        served.init(image, np.array([1.0, 2, 3, 4]))
        boxes.append(served.update(image).box.tolist())
        served.close()
    assert boxes[0] == boxes[1] != boxes[2]


LOUD = """
import os

class Loud:
    def init(self, image, box):
        print("@@TRAX:state of a print")
        os.write(1, b"of a library")

    def update(self, image):
        return 1 / 0
"""


def test_process_of_a_tracker_serves_all_initialisations(environment, folder):
    served, image = (
        start(f"{folder}/plain_tracker.py:python={environment}"),
        np.zeros((9, 9, 3), np.uint8),
    )
    ids = set()
    for _ in range(3):
        served.init(image, np.array([1.0, 2, 3, 4]))
        served.update(image)
        ids |= {*living(str(WORKER))}
    assert len(ids) == 1
    served.close()


@pytest.mark.parametrize("options", ["", f":python={sys.executable}"])
def test_failure_of_a_tracker_ends_the_session_with_its_reason(tmp_path, options):
    (tmp_path / "loud.py").write_text(LOUD)
    tracker, image = start(f"{tmp_path / 'loud.py'}{options}"), np.zeros((24, 32, 3), np.uint8)
    tracker.init(image, np.array([1.0, 2, 3, 4]))
    with pytest.raises(ExternalTrackerError) as raised:
        tracker.update(image)
    reason = str(raised.value).partition("ended the session: ")[2]
    for words in ("ZeroDivisionError: division by zero", "of a print", "of a library"):
        assert words in reason
    assert "ExternalTrackerError" not in reason.partition("\n")[0]


@pytest.mark.parametrize(
    ("name", "problem"),
    [("camshft", "Did you mean 'camshift'?"), ("static:init=full", "Omit init.")],
)
def test_invalid_tracker_is_invalid_usage(name, problem):
    with pytest.raises(ExternalTrackerError) as raised:
        start(name)
    assert "ended with status 2" in str(raised.value)
    assert problem in str(raised.value)


def converse(*requests, error=None):
    """Return the messages of the server after `hello`; `error` is the expected error."""
    answers = io.BytesIO()
    with pytest.raises(TrackerError, match=error) if error else nullcontext():
        serve_client(lambda: trackers.create("static"), "x", [b"a log line\n", *requests], answers)
    return [parse_message(line) for line in answers.getvalue().splitlines()[1:]]


@pytest.mark.parametrize(
    ("name", "address"), [("a b%20=1.png", "a b%20=1.png"), ("ä b.png", "%C3%A4%20b.png")]
)
def test_paths_with_special_characters_are_read(tmp_path, name, address):
    cv2.imwrite(str(tmp_path / name), np.zeros((24, 32, 3), np.uint8))
    frame = format_message("frame", f"file://{tmp_path}/{address}")
    begin = format_message("initialize", "1,2,4,2,4,6,1,6")
    messages = converse(begin, frame, frame, begin, frame, b"@@TRAX:quit\n", frame)
    assert [message.values for message in messages] == [["1.0,2.0,3.0,4.0"]] * 3


def test_invalid_request_ends_the_session(tmp_path):
    cv2.imwrite(str(tmp_path / "1.png"), np.zeros((24, 32, 3), np.uint8))
    frame = format_message("frame", f"file://{tmp_path}/1.png")
    for requests, reason in {
        (frame,): "a frame before initialize",
        (format_message("initialize", "0"), frame): "initialises with '0': no target",
        (b"@@TRAX:state 1\n",): "sent '@@TRAX:state 1'",
        (b"@@TRAX:initialize\n",): "sent '@@TRAX:initialize'",
        (format_message("initialize", "1,2,3"), frame): "initialises with '1,2,3'. Expected",
        (format_message("initialize", "1,2,0,4"), frame): "initialises with '1,2,0,4'. Expected",
        (format_message("frame", "file:///dev/zero"),): "dev/zero' of the client .*not a regular",
        (format_message("frame", "image:" + 9999 * "x"),): "of the client cannot be read: File nam",
        (format_message("frame", str(tmp_path)),): "of the client cannot be read: not a regular",
    }.items():
        last = converse(*requests, error=reason)[-1]
        assert last.name == "quit"
        assert re.search(reason, last.properties["trax.reason"])


def test_client_mistake_is_one_line_without_traceback(tmp_path):
    for request, status in ((b"@@TRAX:state 1\n", 2), (b"@@TRAX:quit\n", 0), (None, 2)):
        (tmp_path / "requests").write_bytes(request or b"")
        redirection = "<&-" if request is None else f"<{tmp_path}/requests"
        command = ["sh", "-c", f"{shlex.join([*COMMAND, 'static'])} {redirection}"]
        done = subprocess.run(command, cwd=HOME, capture_output=True, text=True)
        assert done.returncode == status, done.stderr
        assert "Traceback" not in done.stderr
        assert bool(done.stderr) == bool(status)


def test_vanished_client_ends_the_session():
    reading, writing = os.pipe()
    os.close(reading)
    with (
        os.fdopen(writing, "wb", buffering=0) as answers,
        pytest.raises(TrackerError, match="the client cannot be answered: Broken pipe"),
    ):
        serve_client(lambda: trackers.create("static"), "x", [], answers)


PINS = ["vot-toolkit==0.7.1", "attributee==0.1.9", "phx-class-registry<5", "matplotlib<3.9"]


@pytest.mark.slow
def test_vot_toolkit_runs_our_tracker(tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    folder = tmp_path / "venv" / "bin"
    install = [folder / "python", "-m", "pip", "install", "--quiet", "--retries", "1", *PINS]
    done = subprocess.run(install, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"vot-toolkit cannot be installed: {done.stderr.strip()[-300:]}")
    command = [COMMAND[0], "-c", f"import sys; sys.path.insert(0, {str(HOME)!r}); {COMMAND[2]}"]
    (tmp_path / "trackers.ini").write_text(
        f"[camshift]\nprotocol = trax\ncommand = {shlex.join([*command, 'trax', 'camshift'])}\n"
    )
    test = [folder / "vot", "test", "camshift"]
    done = subprocess.run(test, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert "Test concluded successfuly" in done.stdout + done.stderr  # spelt so by vot-toolkit
    assert done.stdout.count("@@TRAX:state") == 50


def test_tracker_of_a_file_runs_in_the_serving_process(tmp_path):
    """Its time is then that of the process that the client has started."""
    code = (
        "import os\nclass One:\n    def init(self, image, box):\n        print('in', os.getpid())\n"
    )
    (tmp_path / "one.py").write_text(f"{code}    def update(self, image):\n        pass\n")
    tracker = start(tmp_path / "one.py")
    tracker.init(np.zeros((24, 32, 3), np.uint8), np.array([1.0, 2, 3, 4]))
    assert f"in {tracker.process.process.pid}\n" in f"{tracker.process.end_output()}\n"
