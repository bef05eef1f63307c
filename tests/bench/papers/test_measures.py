"""Measures of runs that all papers share, on runs with known results."""

import numpy as np
import pytest

from tests.bench.papers import measured_runs
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.measures import find_measure, parse_frames
from trackmark.bench.papers.paper import read_paper

value = measured_runs.values_of("wang2010")

N = 20


def measured(shifts=0.0, *, visibility=1.0, failure="", absent=()):
    """Return a run on wang2010 whose estimate is `shifts` pixels off a box of 10 x 10.

    Its frames are counted from 1, and it is on target within the tolerance.
    """
    boxes = np.tile([50.0, 50.0, 10.0, 10.0], (N, 1))
    estimates = boxes.copy()
    estimates[:, 0] += shifts
    boxes[list(absent)] = np.nan
    return measured_runs.measured(
        "wang2010", boxes, estimates, visibility, run={"failure": failure}
    )


def off_at(*frames):
    """Return shifts of 8 pixels, beyond the tolerance of 5, in frames counted from 1."""
    shifts = np.zeros(N)
    shifts[[frame - 1 for frame in frames]] = 8.0
    return shifts


@pytest.mark.parametrize(
    ("shifts", "expected"),
    [
        (0.0, 1.0),
        (off_at(3, 4), 1.0),  # nine of ten frames
        (off_at(3, 4, 5), 0.0),
        (off_at(11), 0.0),  # among the last ten
    ],
)
def test_kept_needs_nine_of_ten_frames_and_the_last_ten(shifts, expected):
    assert value("kept_to_end", measured(shifts)) == expected


def test_frames_that_show_little_of_the_target_do_not_count():
    visibility = np.ones(N)
    visibility[4:8] = 0.29
    assert value("kept_to_end", measured(off_at(5, 6, 7, 8), visibility=visibility)) == 1.0
    assert value("on_target", measured(off_at(5, 6, 7), visibility=visibility)) == 1.0


def test_windows_are_counted_as_in_the_paper():
    shifted = measured(off_at(3))
    assert value("mean_error:first=3:last=4", shifted) == 4.0
    assert value("mean_error", shifted) == pytest.approx(8 / N)
    assert value("pattern:tracked=4-20", shifted) == 1.0
    assert value("pattern:tracked=2-3", shifted) == 0.0
    assert value("frames_on_target", shifted) == N - 1
    assert value("mean_error", measured(off_at(1), absent=range(10, 20))) == pytest.approx(0.8)
    assert parse_frames("11+14-16") == [11, 14, 15, 16]


@pytest.mark.parametrize(
    ("shifts", "holds", "lost_before"),
    [
        (off_at(12, 13), 1.0, 0.0),
        (off_at(15), 1.0, 0.0),
        (0.0, 0.0, 0.0),
        (off_at(*range(12, 17)), 0.0, 0.0),  # not back at 16
        (off_at(*range(9, 14)), 0.0, 1.0),  # off before the event
    ],
)
def test_pattern_and_loss_before_its_event(shifts, holds, lost_before):
    measure = find_measure("pattern:tracked=11+16:once_lost=12-15", "wang2010")
    assert measure(measured(shifts)) == holds
    assert measure.lost_before(measured(shifts), **measure.options) == lost_before


def test_pattern_is_lost_in_all_frames():
    assert value("pattern:tracked=10:lost=12+14", measured(off_at(12, 14))) == 1.0
    assert value("pattern:tracked=10:lost=12+14", measured(off_at(12))) == 0.0


def test_failed_run_counts_as_one_without_boxes():
    failed = measured(failure="frame 1: no")
    assert value("kept_to_end", failed) == 0.0
    assert value("mean_error:first=2", failed) == 100.0  # diagonal of 60 x 80
    assert value("mean_overlap", failed) == 1 / N


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("keep", "unknown measure 'keep'"),
        ("kept_to_end:first=3", "no option 'first'"),
        ("mean_error:first=one", "should be a valid integer"),
        ("measure", "unknown measure"),
    ],
)
def test_unknown_measure_or_option_is_named(text, message):
    with pytest.raises(ValueError, match=message):
        find_measure(text, "wang2010")


@pytest.mark.parametrize("paper", paper_names())
def test_captions_of_figures_are_short(paper):
    for entry in read_paper(paper).figure.values():
        captions = entry.caption.values() if isinstance(entry.caption, dict) else [entry.caption]
        assert all(len(f"Fig. 10. {text}.") <= 160 for text in captions)
