"""What every built-in sequence keeps to; what is particular to one has tests of its own."""

import hashlib
import json
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import unless_sealed
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.golden import golden_digests, look_difference
from trackmark.datasets.metadata import sequence_metadata
from trackmark.datasets.synthetic.suite import suites
from trackmark.datasets.versioning import find_version, read_versions

# Of sequences that are made alike, two: clips of a film, walkers before the two kinds of camera.
ALIKE = {"nguyen2002/clip-": ("01", "04"), "multipart/": ("1", "5")}
NAMES = [
    name
    for name in datasets.names()
    if all(not name.startswith(k) or name.removeprefix(k) in ends for k, ends in ALIKE.items())
]
GOLDEN = {
    text: golden
    for suite in suites()
    for seal in read_versions(suite.golden).values()
    for text, golden in seal.golden.items()
}
RENDERED = [name for name in NAMES if not name.startswith("samples/")]

DAILY = ("plain/target", "wang2010/hand", "nguyen2002/lights", "stress/twin")
"""Scenes that are opened every day, though they are as they were sealed: cheap ones."""
SEALED = {*RENDERED} - {*DAILY}


def marked(names):
    """Mark scenes as slow that are as they were sealed, except for some."""
    return [
        pytest.param(name, marks=unless_sealed(name) if name in SEALED else ()) for name in names
    ]


# What another process makes of the same names: fingerprint, and digests of two images.
ELSEWHERE = """
import hashlib, json, sys
from trackmark import datasets
answers = {}
for name in json.loads(sys.argv[1]):
    sequence = datasets.load(name)
    digests = [hashlib.sha256(sequence[frame].tobytes()).hexdigest() for frame in (-1, 1)]
    answers[name] = [sequence.fingerprint, *digests]
print(json.dumps(answers))
"""


@pytest.fixture(scope="module")
def elsewhere():
    answer = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, json.dumps(NAMES)],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(answer.stdout)


class Kept:
    """Frames that are made once for all tests."""

    def __init__(self, frames):
        self.frames, self.made = frames, {}
        self.size = getattr(frames, "size", None)

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, frame):
        if frame not in self.made:
            self.made[frame] = self.frames[frame]
        return self.made[frame]


@cache
def opened(name):
    sequence = datasets.load(name)
    sequence.frames = Kept(sequence.frames)
    _ = sequence[-1]  # the last first, while those that are sealed were made in order
    return sequence


@pytest.fixture(params=marked(NAMES))
def sequence(request):
    return opened(request.param)


@pytest.fixture(params=marked(RENDERED))
def rendered(request):
    return opened(request.param)


def test_it_can_be_run(sequence):
    sequence.check_runnable()
    assert len(sequence) > 1
    assert sequence.name in datasets.names()


def test_its_summary_is_true(sequence):
    summary = datasets.summary(sequence.name)
    assert len(sequence) == summary.length
    assert sequence[0].shape == (*summary.size[::-1], 3)


@pytest.mark.slow  # every clip is opened, which takes its truth
@pytest.mark.parametrize("name", datasets.names())
def test_summary_and_description_are_those_of_the_opened_sequence(name):
    sequence = datasets.load(name)
    assert datasets.summary(name).length == len(sequence)
    assert datasets.describe(name) == sequence_metadata(sequence)


def test_images_are_as_agreed(sequence):
    first, last = sequence[0], sequence[-1]
    assert first.shape == last.shape
    assert sequence.frames.size in (None, first.shape[1::-1])
    for image in (first, last):
        assert image.dtype == np.uint8
        assert image.flags.c_contiguous
        assert not image.flags.writeable


def test_boxes_show_something_of_the_image(sequence):
    height, width = sequence[0].shape[:2]
    x, y, w, h = sequence.boxes[sequence.present].T
    assert (w > 0).all()
    assert (h > 0).all()
    assert ((x < width) & (y < height) & (x + w > 0) & (y + h > 0)).all()


def test_visibility_is_a_fraction(sequence):
    known = sequence.visibility[np.isfinite(sequence.visibility)]
    assert ((known >= 0) & (known <= 1)).all()


def test_truth_is_known_of_every_frame_of_a_scene(rendered):
    assert np.isfinite(rendered.visibility).all()
    assert (rendered.present | (rendered.visibility == 0)).all()
    assert rendered.fps in (25, 30)


def test_images_and_truth_are_the_sealed_ones(rendered):
    """See `datasets.versioning`; what is sealed of other scenes is in `test_golden_frames.py`.

    A change here changes every result on the sequence. If it is meant, look at the pictures and
    give the scene a new version: `python -m trackmark.bench.evaluation.version_check --new NAME`.
    """
    assert datasets.describe(rendered.name) == sequence_metadata(rendered)  # sealed, too
    if rendered.name not in GOLDEN:  # of stress/twin a harder variant is
        return
    sealed, found = GOLDEN[rendered.name], golden_digests(rendered)
    difference = look_difference(sealed["look"], found["look"])
    assert difference <= 1, f"the pictures changed, tiles by up to {difference} grey levels"
    assert found["truth"] == sealed["truth"], "the truth changed, though the pictures look alike"
    assert found["images"] == sealed["images"], (
        "the pictures look alike but differ in their bytes: another platform's arithmetic, or a "
        "small change of the renderer"
    )


def test_masks_lie_in_their_regions(sequence):
    n = len(sequence)
    for frame in {sequence.first_frame, n // 3, 2 * n // 3, n - 1}:
        mask = sequence.mask(frame)
        if mask is None:
            return
        assert mask.dtype == np.bool_
        assert mask.shape == sequence[0].shape[:2]
        if not sequence.present[frame]:
            assert not mask.any()
            continue
        rows, columns = np.nonzero(mask)
        x, y, width, height = sequence.regions.get("tight", sequence.boxes)[frame]
        inside = (
            (columns > x - 2) & (columns < x + width + 1) & (rows > y - 2) & (rows < y + height + 1)
        )
        assert inside.sum() >= 0.95 * len(rows)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in GOLDEN else ()) for name in NAMES]
)
def test_any_order_gives_the_same_images(name):
    sequence = opened(name)
    n = len(sequence)
    again = datasets.load(name)
    for frame in (4, 0, n - 1):  # the last one was the first to be made
        assert (again[frame] == sequence[frame]).all()


def test_a_slice_has_the_frames_and_truth_of_the_whole(sequence):
    part = sequence[1:9:3]
    assert (part[1] == sequence[4]).all()
    assert np.array_equal(part.boxes, sequence.boxes[1:9:3], equal_nan=True)
    assert part.fingerprint != sequence.fingerprint


@pytest.mark.slow
def test_another_process_finds_the_same(sequence, elsewhere):
    fingerprint, *digests = elsewhere[sequence.name]
    assert sequence.fingerprint == fingerprint
    assert [hashlib.sha256(sequence[frame].tobytes()).hexdigest() for frame in (-1, 1)] == digests


@pytest.mark.slow  # what is sealed of scenes says it every day
def test_scenes_differ_in_pictures_and_in_truth(rendered):
    other = datasets.load(f"{rendered.name}:scene=1")
    assert np.abs(rendered[0].astype(int) - other[0]).mean() > 4
    frames = range(min(len(rendered), len(other)))
    assert not np.array_equal(rendered.boxes[frames], other.boxes[frames], equal_nan=True)


def test_noise_is_new_in_every_frame(rendered):
    one, other = (rendered[frame].astype(int) for frame in (3, 4))
    assert 0.5 < (one != other).mean() < 1


def test_an_unknown_option_is_an_error_that_names_it(sequence):
    with pytest.raises(SequenceError, match="no-such-option"):
        datasets.load(f"{sequence.name}:no-such-option=1")


KNOBS = {name: {knob["name"]: knob for knob in datasets.options(name)} for name in RENDERED}


@pytest.mark.parametrize(
    ("name", "knob"), [(name, knob) for name, knobs in KNOBS.items() for knob in knobs]
)
def test_a_bad_value_is_refused_in_a_line_that_names_the_knob(name, knob):
    for value in ("-9", "1e99", "no-such-word"):
        with pytest.raises(SequenceError, match=rf"^{name}: [^\n]*{knob}[^\n]*$"):
            datasets.load(f"{name}:{knob}={value}")


@pytest.mark.parametrize("name", RENDERED)
def test_knobs_are_described(name):
    assert {"scene"} <= set(KNOBS[name])
    assert all(knob["meaning"] for knob in KNOBS[name].values())


@pytest.mark.parametrize("name", marked(RENDERED))
def test_a_knob_at_its_default_is_no_part_of_the_name(name):
    said = ":".join(f"{key}={knob['default']}" for key, knob in KNOBS[name].items())
    assert datasets.load(f"{name}:{said}").fingerprint == datasets.load(name).fingerprint
    assert datasets.load(f"{name}:{said}").name == name


def test_no_two_sequences_have_the_same_fingerprint():
    fingerprints = [datasets.describe(name).fingerprint for name in datasets.names()]
    assert len(set(fingerprints)) == len(fingerprints)


@pytest.mark.parametrize("suite", suites(), ids=lambda suite: suite.golden.parent.name)
def test_scenes_are_those_that_were_sealed(suite):
    """What is sealed is proved by `make test-full`, and here of scenes that were edited since."""
    edited = [
        name for name in suite.names() if find_version(name, suite.golden).tree != suite.tree(name)
    ]
    assert not edited, "run `make seal`: it compares their pixels with the sealed ones"


def test_names_options_and_summaries_bring_no_renderer():
    code = (
        "import sys\nfrom trackmark import datasets\n"
        "for name in datasets.names(): datasets.options(name), datasets.summary(name)\n"
        "print({'numba', 'cv2', 'av'} & set(sys.modules))"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "set()"


def test_a_summary_of_an_unknown_name_is_refused():
    with pytest.raises(SequenceError, match="wang2010/cup"):
        datasets.summary("wang2010/cupp")
