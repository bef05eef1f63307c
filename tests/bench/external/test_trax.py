"""Client of TraX: messages, regions, and real trackers in Python and C++."""

import os
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from math import isnan
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.bench.external.conftest import TRAX
from trackmark.bench.external.definition import open_external
from trackmark.bench.external.process import ExternalTrackerError
from trackmark.bench.external.trax import (
    format_message,
    format_region,
    parse_message,
    parse_region,
)

BOX = np.array([5.1, 6.25, 20.3, 1 / 3])
SHAPE = (24, 32)
PLAIN = sys.executable, str(TRAX)


def image(frame=0):
    return np.random.default_rng(frame).integers(0, 256, (*SHAPE, 3), dtype=np.uint8)


def start(*command):
    return open_external("trax", {"command": shlex.join(command), "as": "mine"}).create()


def run(tracker, frames=6, mask=None):
    """Return the estimates of a tracker, whose process must end by itself when it is closed."""
    tracker.init(image(), BOX, mask)
    estimates = [tracker.update(image(frame)) for frame in range(1, frames)]
    tracker.close()
    assert_ended(tracker)
    assert tracker.process._process.returncode == 0
    return estimates


def assert_ended(tracker):
    with pytest.raises(ProcessLookupError):
        os.kill(tracker.process._process.pid, 0)
    assert not Path(tracker.process.file).exists()


def test_messages_survive_a_round_trip():
    values = ['a "quoted" \\ word', "two\nlines", "file:///a=b/c.jpg", "", "ö"]
    line = format_message("frame", *values, **{"a.b": "x=1", "c": 2})
    assert line.count(b"\n") == 1
    assert parse_message(line) == ("frame", values, {"a.b": "x=1", "c": "2"})
    unquoted = parse_message(b"log @@TRAX:state 1,2,3,4 confidence=0.5 \r")
    assert unquoted == ("state", ["1,2,3,4"], {"confidence": "0.5"})


@pytest.mark.parametrize("text", ["1,2,3,4", "1,2,4,2,4,6,1,6", "1;2;3;4", "2,2,4,4,3,6,1,3,2,2"])
def test_region_gives_bounding_box(text):
    box, mask = parse_region(text, SHAPE)
    assert box.tolist() == [1, 2, 3, 4]
    assert mask is None


@pytest.mark.parametrize(
    "text",
    ["", "a,b", "nan,1,2,3", "1,inf,2,3", "1,2,3", "1,2", "mask:", "mask:1,2,3", "mask:0,0,-1,2,3"]
    + ["mask:0,0,99999,99999,1", "mask:0,0,4,4,1,-1", "mask:0,0,2,2,5", "m0,0,2,2,0,4"],
)
def test_malformed_region_is_rejected(text):
    with pytest.raises(ValueError):  # noqa: PT011  # the client names the region
        parse_region(text, SHAPE)


@pytest.mark.parametrize("text", ["0", "-3", "mask:1,2,3,4,12", "mask:90,0,2,2,0,4"])
def test_region_without_target_has_no_box(text):
    assert parse_region(text, SHAPE)[0] is None


def test_mask_is_cropped_to_the_image():
    whole = np.zeros((40, 60), np.bool_)
    whole[5:35, 10:55] = True
    whole[20, 20] = False
    text = format_region(["rectangle", "mask"], BOX, whole)
    assert text.startswith("mask:0,0,60,40,310,45,15,")
    box, mask = parse_region(text.replace("mask:0,0,", "mask:-15,-8,"), SHAPE)
    assert np.array_equal(mask, whole[8:32, 15:47])
    assert box.tolist() == [0, 0, 32, 24]


def test_box_is_formatted_exactly():
    for formats in (["rectangle"], ["mask", "polygon", "rectangle"]):
        assert parse_region(format_region(formats, BOX), SHAPE)[0].tolist() == BOX.tolist()
    box, _ = parse_region(format_region(["polygon"], BOX), SHAPE)
    assert box == pytest.approx(BOX, abs=1e-14)  # opposite corners are sums
    box, mask = parse_region(format_region(["mask"], np.array([5.2, 6.4, 8.6, 0.2])), SHAPE)
    assert box.tolist() == [5, 6, 9, 1]
    assert mask.sum() == 9


@pytest.mark.parametrize("version", ["1", "2", "3", "4"])
def test_plain_tracker_of_each_version_returns_the_exact_box(version):
    for estimate in run(start(*PLAIN, version)):
        assert estimate.box.tolist() == BOX.tolist()
        assert (estimate.visible, estimate.confidence) == (True, 0.5)


@pytest.mark.parametrize("region", ["rectangle", "polygon", "mask"])
@pytest.mark.parametrize("form", ["path", "memory", "buffer"])
def test_tracker_of_the_library_gets_images_and_regions(form, region):
    if find_spec("trax") is None:
        pytest.skip("vot-trax is not installed (`make setup` installs it)")
    mask = np.zeros(SHAPE, np.bool_)
    mask[7:15, 9:20] = mask[15:20, 9] = True
    tracker = start(sys.executable, str(TRAX.with_name("library.py")), form, region)
    for frame, estimate in enumerate(run(tracker, mask=mask if region == "mask" else None), 1):
        assert estimate.confidence == pytest.approx(image(frame)[12, 16, 0] / 255, abs=1e-6)
        if region == "mask":
            assert np.array_equal(estimate.mask, mask)
            assert estimate.box.tolist() == [9, 7, 11, 13]
        else:  # the library stores numbers in single precision and writes four decimals
            assert estimate.box == pytest.approx(BOX, abs=2e-4)


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """Return the path of the tracker in C++."""
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("g++ is not installed")
    program = str(tmp_path_factory.mktemp("trax") / "tracker")
    source = TRAX.with_name("tracker.cpp")
    subprocess.run([compiler, "-std=c++11", "-o", program, source], check=True)
    return program


@pytest.mark.parametrize("version", ["1", "4"])
def test_compiled_tracker_returns_the_box(compiled, version):
    for estimate in run(start(compiled, version)):
        assert estimate.box == pytest.approx(BOX, abs=1e-14)
        assert isnan(estimate.confidence)


FAILURES = {  # mode: words of the error; test_process.py has further ends of processes
    "raise": ("ended with status 1. Its last line: ValueError: broken", "in main"),
    "exit": ("ended with status 7",),
    "signal": ("ended by signal 6 (Aborted)", "a log line"),
    "hang": ("did not answer in 60 s", "a log line"),
    "flood": ("ended with status 7. The end of its output:\nyyy",),
    "garbage": ("answered with the region 'nonsense,1'. Expected:",),
    "nan": ("answered with the region 'nan,1,2,3'. Expected:",),
    "confidence": ("the confidence 7. Expected: a number from 0 to 1. Add confidence=false",),
    "quit": ('ended the session: out of "memory"',),
    "hello": ("sent '@@TRAX:hello'. Expected: the message 'state'",),
}


def assert_fails(tracker, command, words):
    """Check the error in the third update; the process must have ended."""
    tracker.init(image(), BOX)
    with pytest.raises(ExternalTrackerError) as raised:
        [tracker.update(image(frame)) for frame in range(1, 4)]
    tracker.close()
    assert_ended(tracker)
    assert str(raised.value).startswith(f"{shlex.join(command)}: the process ")
    assert all(word in str(raised.value) for word in words), raised.value


@pytest.mark.parametrize("mode", FAILURES)
def test_failure_names_command_status_and_output(mode):
    command = [*PLAIN, "4", mode]
    assert_fails(start(*command), command, FAILURES[mode])


def test_failure_of_compiled_tracker_names_its_output(compiled):
    command = [compiled, "4", "signal"]
    assert_fails(start(*command), command, ["ended by signal 6", "width 32"])


REFUSED = {
    "4 slow": "did not answer in 300 s. The end of its output:\nloading weights",
    "4 depth": "reads the image channels ['depth']. Expected: color",
    "4 url": "reads images by ['url']. Expected: path, memory or buffer",
    "5": "uses version '5' of TraX. Expected: 1 to 4",
}


@pytest.mark.parametrize("arguments", REFUSED)
def test_start_that_fails_is_explained(arguments):
    with pytest.raises(ExternalTrackerError) as raised:
        start(*PLAIN, *arguments.split())
    assert REFUSED[arguments] in str(raised.value)


def test_special_region_keeps_the_last_box():
    estimates = run(start(*PLAIN, "4", "special"))
    assert [estimate.visible for estimate in estimates] == [True, True, False, False, False]
    assert all(estimate.box.tolist() == BOX.tolist() for estimate in estimates)


def test_images_of_any_size_are_passed():
    tracker = start(*PLAIN, "4")
    for shape in [(24, 32, 3), (7, 5, 3), (6, 6, 3), (24, 32, 3)]:
        pixels = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
        tracker.init(pixels, BOX)
        assert np.array_equal(cv2.imread(tracker.process.file), pixels)
    tracker.close()
