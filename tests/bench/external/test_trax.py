"""Client of TraX: messages, regions, and real trackers."""

import shlex
import sys
from contextlib import nullcontext
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from tests.bench.external.conftest import TRAX
from trackmark.bench.external.definition import open_external
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


def run(tracker, mask=None):
    """Return the estimates of a tracker, whose process must end by itself when it is closed."""
    tracker.init(image(), BOX, mask)
    estimates = [tracker.update(image(frame)) for frame in range(1, 6)]
    tracker.close()
    assert tracker.process.process.returncode == 0
    assert not Path(tracker.process.file).exists()
    return estimates


def test_messages_survive_a_round_trip():
    values = ['a "quoted" \\ word', "two\nlines", "file:///a=b/c.jpg", "", "ö"]
    line = format_message("frame", *values, **{"a.b": "x=1", "c": 2})
    assert line.count(b"\n") == 1
    assert parse_message(line) == ("frame", values, {"a.b": "x=1", "c": "2"})
    unquoted = parse_message(b"log @@TRAX:state 1,2,3,4 confidence=0.5 \r")
    assert unquoted == ("state", ["1,2,3,4"], {"confidence": "0.5"})


REGIONS = {  # by their boxes; None without a target
    (1, 2, 3, 4): ["1,2,3,4", "1,2,4,2,4,6,1,6", "1;2;3;4", "2,2,4,4,3,6,1,3,2,2"],
    None: ["0", "-3", "mask:1,2,3,4,12", "mask:90,0,2,2,0,4"],
    ValueError: ["", "a,b", "nan,1,2,3", "1,inf,2,3", "1,2,3", "1,2", "mask:", "mask:1,2,3"]
    + ["mask:0,0,-1,2,3", "mask:0,0,99999,99999,1", "mask:0,0,4,4,1,-1", "mask:0,0,2,2,5"]
    + ["m0,0,2,2,0,4"],
}


@pytest.mark.parametrize(("expected", "text"), [(e, t) for e in REGIONS for t in REGIONS[e]])
def test_region_gives_bounding_box_or_error(expected, text):
    with pytest.raises(ValueError) if expected is ValueError else nullcontext():  # noqa: PT011  # the client names the region
        box, _ = parse_region(text, SHAPE)
        assert box is expected if expected is None else tuple(box) == expected


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


def test_special_region_keeps_the_last_box():
    estimates = run(start(*PLAIN, "4", "special"))
    assert [estimate.visible for estimate in estimates] == [True, True, False, False, False]
    assert all(estimate.box.tolist() == BOX.tolist() for estimate in estimates)


def test_region_with_decimal_commas_is_refused():
    with pytest.raises(ValueError, match="10,5000"):
        parse_region("10,5000,20,2500,30,0000,40,0000", SHAPE)
