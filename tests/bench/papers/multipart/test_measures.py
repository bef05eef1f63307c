"""Frames on target, overlapping and before the loss; the choice by Eq. 7."""

import numpy as np
import pytest

from tests.bench.papers import measured_runs
from tests.bench.papers.conftest import stored_runs
from trackmark.bench.papers.multipart import scenes
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.runs import PaperRuns
from trackmark.datasets import Sequence

value = measured_runs.values_of("multipart")

N = 30
PERSON = np.array([50.0, 20.0, 20.0, 60.0])
BODY = np.array([54.0, 30.0, 12.0, 45.0])


def measured(shifts=0.0, *, hidden=(), failure=""):
    """Return a run that started from the body whose estimate is `shifts` pixels to its right."""
    estimates = np.tile(BODY, (N, 1))
    estimates[:, 0] += shifts
    visibility = np.ones(N)
    visibility[list(hidden)] = 0.2
    boxes, regions = np.tile(BODY, (N, 1)), {"full": np.tile(PERSON, (N, 1))}
    run = {"failure": failure}
    return measured_runs.measured(
        "multipart", boxes, estimates, visibility, (160, 120), run, regions=regions
    )


def off_from(first, last=N, pixels=11.0):
    """Return shifts in frames from `first` to before `last`, counted from 0."""
    shifts = np.zeros(N)
    shifts[first:last] = pixels
    return shifts


def test_frame_counts_with_its_centre_inside_the_person():
    assert value("frames_on_target", measured(off_from(20, pixels=9.5))) == N
    assert value("frames_on_target", measured(off_from(20, pixels=10.5))) == 20
    assert value("frames_on_target", measured(failure="frame 1: no")) == 1  # only the init box


def test_overlap_is_with_the_region_of_the_start():
    assert value("frames_overlapping", measured(off_from(20, pixels=3.5))) == N
    assert value("frames_overlapping", measured(off_from(20, pixels=4.5))) == 20


@pytest.mark.slow
def test_stored_run_is_judged_by_the_region_of_its_start(tmp_path):
    tracker, scene = "multipart:particles=2:init=full", "stress/twin:scene=0"
    requested = {"twin": stored_runs(tmp_path / "twin", [tracker], [scene])}
    runs = PaperRuns(tmp_path, requested, read_paper("multipart").frame_rules)
    stored = runs.measured_run(tracker, scene)
    np.testing.assert_array_equal(stored.truth.boxes, stored.truth.regions["full"])
    assert stored.error[0] == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("shifts", "hidden", "expected"),
    [
        (off_from(12), (), 12),
        (off_from(5, 14), (), N),  # nine frames
        (off_from(5, 15), (), 5),
        (off_from(5, 15), (7,), N),  # nine visible frames
    ],
)
def test_target_is_lost_after_ten_visible_frames_off_it(shifts, hidden, expected):
    assert value("frames_before_loss", measured(shifts, hidden=hidden)) == expected


def halves(upper, lower):
    """Return a scene of one image with a person whose halves have two grey levels."""
    image = np.full((120, 160, 3), 128, np.uint8)
    image[20:50, 50:70], image[50:80, 50:70] = upper, lower
    box = PERSON[np.newaxis]
    return Sequence("halves", [image], box, fingerprint="halves", regions={"full": box})


@pytest.mark.parametrize(
    ("sequence", "upper", "lower", "right"),
    [("1", 20, 240, 1.0), ("1", 20, 20, 0.0), ("3", 20, 20, 1.0), ("3", 20, 240, 0.0)],
)
def test_right_choice_is_two_parts_for_two_colours_alone(
    monkeypatch, sequence, upper, lower, right
):
    monkeypatch.setattr(scenes.datasets, "load", lambda _: halves(upper, lower))
    for tracker in ("multipart:binning=both:uv_range=full", "multipart:binning=perez"):
        assert scenes.right_choice(f"multipart/{sequence}:scene=1", tracker) == right
