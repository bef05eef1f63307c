"""Speed of trackers relative to OpenCV's mean shift, and growth with their sample numbers.

The mean shift uses a hue back-projection. The tests compare processor time in one process, on the
same frames and in turns. Such ratios are comparable across machines. `make bench` runs the tests;
`pytest -s` prints the ratios and the overlaps. Reproductions of papers print times in milliseconds.
"""

from itertools import pairwise
from statistics import median

import numpy as np
import pytest

from tests.speed import clips
from tests.speed.rivals import MeanShift, compare, print_ratio, run, seconds_of, warm
from trackmark import trackers
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.motion import states_at_rest

LEEWAY = 1.7
"""Tolerance factor for other and busy machines. A time that doubles is still detected."""

MEAN_SHIFTS = {
    clips.large: {
        "camshift": 0.4,
        "mean-shift:preset=as-written": 0.5,
        "mean-shift": 0.9,
        "mean-shift-kalman:preset=as-written": 1.0,
        "mean-shift-kalman": 1.4,
        "multipart:representation=single": 0.7,
        "multipart:representation=multi": 0.75,
        "nummiaro2003:preset=as-written": 1.8,
        "nummiaro2003": 1.8,
        "nummiaro2003:preset=as-written:particles=200": 3.1,
        "nummiaro2003:particles=200": 2.5,  # ellipses shrink
        "wang2010:preset=as-written": 2.0,  # with the motion of the whole frame
        "wang2010": 2.0,
        "particle-filter": 2.5,
        "camshift-improved": 1.5,
    },
    clips.small: {"wang2010": 3.7},
    clips.disc: {"moreno2005": 113, "contour-smooth-color": 41},
    clips.hidden: {
        "nguyen2002:preset=as-written:features=intensity": 2.3,
        "nguyen2002:preset=as-written:features=rgb": 4.2,
        "nguyen2002:preset=as-written": 4.2,
        "nguyen2002:features=intensity": 3.0,
        "nguyen2002:features=rgb": 6.2,
        "nguyen2002": 6.2,
        "nguyen2002:features=arctan": 6.2,
    },
}
"""Usual time per frame, by clip and tracker, as a multiple of the time of a mean shift.

The mean shift includes the back-projection of the whole frame.
"""


@pytest.mark.parametrize(
    ("clip", "text", "usual"),
    [(clip, *row) for clip, rows in MEAN_SHIFTS.items() for row in rows.items()],
)
def test_frame_time_in_mean_shifts_is_as_usual(clip, text, usual):
    rounds = 2 if clip is clips.disc else 3
    assert compare(clip(), warm(text, clip()), MeanShift(), rounds) > 1 / (LEEWAY * usual)


@pytest.mark.parametrize(
    ("clip", "tracker", "parameter", "numbers", "at_most"),
    [
        (clips.large, "multipart", "particles", (100, 400, 1600), 4.5),
        (clips.large, "nummiaro2003", "particles", (100, 400, 1600), 4.5),
        (clips.large, "wang2010:radius=4", "particles", (60, 600, 6000), 11),
        (clips.disc, "moreno2005", "colour_samples", (75, 300), 4),
        (clips.disc, "moreno2005", "contour_samples", (125, 500), 4),
        (clips.disc, "moreno2005", "plane_samples", (5, 20), 4),
    ],
)
def test_frame_time_grows_at_most_with_the_sample_number(
    clip, tracker, parameter, numbers, at_most
):
    medians = []
    for number in numbers:
        seconds = []
        run(warm(f"{tracker}:{parameter}={number}", clip()), clip(), seconds, n=12)
        medians.append(median(seconds))
    print_ratio({n: f"{value * 1e3:.3f} ms" for n, value in zip(numbers, medians, strict=True)})
    for less, more in pairwise(medians):
        assert more < at_most * less


def scatter_multipart(tracker, rng):
    places = rng.uniform(30, 610, 200), rng.uniform(70, 410, 200)
    tracker._states = np.column_stack([*places, np.full(200, 8400.0)])


def scatter_nummiaro2003(tracker, rng):
    places = np.column_stack([rng.uniform(30, 610, 100), rng.uniform(70, 410, 100)])
    tracker._particles = states_at_rest(places, tracker._mean[4:6])


def scatter_wang2010(tracker, rng):
    tracker._positions = np.column_stack([rng.uniform(30, 610, 60), rng.uniform(70, 410, 60)])


@pytest.mark.parametrize(
    ("scatter", "tracker", "at_most"),
    [
        (scatter_multipart, "multipart", 12),  # usually 7
        (scatter_nummiaro2003, "nummiaro2003:placement=image", 3),
        (scatter_wang2010, "wang2010", 4),  # usually 2.2 to 2.6
    ],
)
def test_frame_time_of_scattered_particles_is_limited(scatter, tracker, at_most):
    images, _ = clips.large()
    tracker, rng = warm(tracker, clips.large()), np.random.default_rng(0)
    scattered, usual = [], []
    for _ in range(2):
        run(tracker, clips.large(), usual)
        for image in images[1:]:
            scatter(tracker, rng)
            scattered.append(seconds_of(tracker.update, image))
    ratio = median(scattered) / median(usual)
    print_ratio(f"scattered {median(scattered) * 1e3:.3f} ms: {ratio:.1f} usual frames")
    assert ratio < at_most


@pytest.mark.parametrize(
    ("name", "number", "size", "at_most"),
    [
        ("multipart", 60, (43, 140), 1.0),
        ("multipart", 60, (60, 140), 1.0),
        ("multipart", 60, (94, 260), 1.0),
        ("nummiaro2003", 40, (60, 140), 1.02),
        ("wang2010", 20, (60, 140), 0.8),
    ],
)
def test_trackers_on_shared_frames_are_faster_than_alone(name, number, size, at_most):
    images, truth = clips.large()
    sharing = [trackers.create(name, seed) for seed in range(number)]
    singles = [trackers.create(name, seed) for seed in range(number)]
    box = np.array([*truth[0, :2] - [0, max(size[1] - 140, 0) / 2], *size])
    first = SharedFrame(images[0], number)
    for tracker, single in zip(sharing, singles, strict=True):
        tracker.init_shared(first, box)
        single.init(images[0], box)
    alone, together = [], []
    for image in images[1:13]:
        shared = SharedFrame(image, number)
        together.append(sum(seconds_of(tracker.update_shared, shared) for tracker in sharing))
        alone.append(sum(seconds_of(single.update, image) for single in singles))
    ratio = median(together) / median(alone)
    print_ratio(f"time on shared frames is {ratio:.2f} of the time alone")
    assert ratio < at_most


def test_nguyen2002_time_at_the_end_of_an_occlusion():
    images, truth = clips.hidden()
    tracker = trackers.create("nguyen2002", features="rgb")
    run(tracker, clips.hidden(), n=len(images))  # compile the kernels of occlusions, too
    tracker.init(images[0], truth[0])
    usual, ends = [], []
    for image in images[1:]:
        estimates = []
        seconds = seconds_of(lambda: estimates.append(tracker.update(image)))  # noqa: B023  # called at once
        (ends if estimates[0].revised else usual).append(seconds)
    assert ends, "the tracker detected no occlusion"
    frames = max(ends) / median(usual)
    print_ratio(f"usual {median(usual) * 1e3:.2f} ms; end of occlusion {frames:.0f} usual frames")
    assert frames < LEEWAY * 32  # 30 frames again, and a wider search


def test_moreno2005_slow_frames_are_close_to_the_median():
    seconds = []
    tracker = warm("moreno2005", clips.disc())
    for _ in range(2):
        run(tracker, clips.disc(), seconds)
    ratio = np.percentile(seconds, 95) / median(seconds)
    print_ratio(f"the 95th percentile is {ratio:.2f} medians")
    assert ratio < 2
