"""Rules for all built-in sequences, their versions and golden digests."""

import itertools
from functools import cache
from pkgutil import resolve_name

import numpy as np
import pytest

from tests.datasets.synthetic.scenes import slow_if_unchanged
from tools.golden_digests import golden_digests, look_difference
from trackmark import datasets
from trackmark.datasets import SequenceError
from trackmark.datasets.catalogue import SUITES as SUITE_PATHS
from trackmark.datasets.catalogue import suites
from trackmark.datasets.interface import sequence_metadata
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.suite import FOLDER, SyntheticSuite
from trackmark.datasets.versioning import VersionEntry, find_version, read_versions

SIMILAR = {"nguyen2002/clip-": ("01", "04"), "multipart/": ("1", "5")}
"""Representatives of similar sequences: two clips of the film, a walker per kind of camera."""

NAMES = [
    name
    for name in datasets.names()
    if all(not name.startswith(k) or name.removeprefix(k) in ends for k, ends in SIMILAR.items())
]
SYNTHETIC = [name for name in NAMES if not name.startswith("samples/")]
PARAMETERS = {
    name: {parameter["name"]: parameter for parameter in datasets.options(name)}
    for name in SYNTHETIC
}
SUITES = [suite for suite in suites() if isinstance(suite, SyntheticSuite)]
VERSIONS = [version for suite in SUITES for version in read_versions(suite.golden).values()]
GOLDEN = {text: golden for version in VERSIONS for text, golden in version.golden.items()}
EVERYDAY = ("plain/target", "wang2010/hand", "stress/twin")
"""Cheap scenes that are tested every day, even if their source is unchanged."""


def parametrized(names):
    """Mark unchanged scenes as slow, except for `EVERYDAY`."""
    is_slow = {*SYNTHETIC} - {*EVERYDAY}
    return [
        pytest.param(name, marks=slow_if_unchanged(name) if name in is_slow else ())
        for name in names
    ]


class CachedFrames:
    """Frames that are computed once for all tests."""

    def __init__(self, frames):
        self.frames, self.images = frames, {}
        self.size = getattr(frames, "size", None)

    def __len__(self):
        return len(self.frames)

    def __getitem__(self, frame):
        if frame not in self.images:
            self.images[frame] = self.frames[frame]
        return self.images[frame]


@cache
def load_cached(name):
    sequence = datasets.load(name)
    sequence.frames = CachedFrames(sequence.frames)
    _ = sequence[-1]  # golden digests read the images in another order
    return sequence


@pytest.fixture(params=parametrized(NAMES))
def sequence(request):
    return load_cached(request.param)


@pytest.fixture(params=parametrized(SYNTHETIC))
def synthetic(request):
    return load_cached(request.param)


def test_sequence_is_runnable_and_has_its_summary(sequence):
    sequence.check_runnable()
    summary = datasets.sequence_size(sequence.name)
    assert len(sequence) == summary.length > 1
    assert sequence.frames.size in (None, summary.size)
    for image in (sequence[0], sequence[-1]):
        assert image.shape == (*summary.size[::-1], 3)
        assert image.dtype == np.uint8
        assert image.flags.c_contiguous
        assert not image.flags.writeable


@pytest.mark.slow  # opens all clips, which computes their ground truth
@pytest.mark.parametrize("name", datasets.names())
def test_stored_metadata_agree_with_the_opened_sequence(name):
    sequence = datasets.load(name)
    assert datasets.sequence_size(name).length == len(sequence)
    assert datasets.describe(name) == sequence_metadata(sequence)


def test_ground_truth_has_valid_values(sequence):
    height, width = sequence[0].shape[:2]
    x, y, w, h = sequence.boxes[sequence.present].T
    assert (w > 0).all()
    assert (h > 0).all()
    assert ((x < width) & (y < height) & (x + w > 0) & (y + h > 0)).all()
    visibility = sequence.visibility[np.isfinite(sequence.visibility)]
    assert ((visibility >= 0) & (visibility <= 1)).all()


def test_ground_truth_of_scenes_is_complete(synthetic):
    assert np.isfinite(synthetic.visibility).all()
    assert (synthetic.present | (synthetic.visibility == 0)).all()
    assert synthetic.fps in (25, 30)


def test_scene_has_its_golden_digests(synthetic):
    """Compare images and ground truth with the golden digests.

    A change affects all results on the sequence. If it is intended, check the images and give the
    scene a new version: `python -m tools.golden_check --new NAME`.
    """
    assert datasets.describe(synthetic.name) == sequence_metadata(synthetic)
    if synthetic.name not in GOLDEN:  # only a harder variant of stress/twin has golden digests
        return
    golden, digests = GOLDEN[synthetic.name], golden_digests(synthetic)
    difference = look_difference(golden["look"], digests["look"])
    assert difference <= 1, f"the images changed, tiles by up to {difference} grey levels"
    assert digests["truth"] == golden["truth"], "the ground truth changed, the images did not"
    assert digests["images"] == golden["images"], (
        "the images look equal, but their bytes differ: another platform's arithmetic, or a small "
        "change of the renderer"
    )


def test_masks_are_inside_their_regions(sequence):
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
def test_images_do_not_depend_on_the_order_of_access(name):
    sequence, reopened = load_cached(name), datasets.load(name)
    for frame in (4, 0, len(sequence) - 1):  # `load_cached` computed the last frame first
        assert (reopened[frame] == sequence[frame]).all()


def test_slice_has_the_frames_and_boxes_of_the_sequence(sequence):
    part = sequence[1:9:3]
    assert (part[1] == sequence[4]).all()
    assert np.array_equal(part.boxes, sequence.boxes[1:9:3], equal_nan=True)
    assert part.fingerprint != sequence.fingerprint


def test_noise_differs_between_frames(synthetic):
    assert 0.5 < (synthetic[3].astype(int) != synthetic[4]).mean() < 1


@pytest.mark.parametrize("name", SYNTHETIC)
def test_invalid_option_is_refused_by_name(name):
    assert "scene" in PARAMETERS[name]
    assert all(parameter["meaning"] for parameter in PARAMETERS[name].values())
    for option in ("no-such-option", *PARAMETERS[name]):
        for value in ("-9", "1e99", "no-such-word"):
            with pytest.raises(SequenceError, match=rf"^{name}: [^\n]*{option}[^\n]*$"):
                datasets.load(f"{name}:{option}={value}")


@pytest.mark.parametrize("name", parametrized(SYNTHETIC))
def test_default_value_is_not_part_of_the_name(name):
    defaults = ":".join(f"{key}={option['default']}" for key, option in PARAMETERS[name].items())
    assert datasets.name_and_fingerprint(f"{name}:{defaults}") == datasets.name_and_fingerprint(
        name
    )
    assert datasets.load(f"{name}:{defaults}").name == name


def test_fingerprints_are_unique():
    fingerprints = [datasets.describe(name).fingerprint for name in datasets.names()]
    assert len(set(fingerprints)) == len(fingerprints)


def test_every_folder_of_scenes_is_in_the_catalogue():
    folders = {file.parent.name for file in FOLDER.glob("*/golden.json")}
    assert folders == {suite.golden.parent.name for suite in SUITES}
    for prefix, path in SUITE_PATHS.items():
        assert any(name.startswith(f"{prefix}/") for name in resolve_name(path).names())


@pytest.mark.parametrize("suite", SUITES, ids=lambda suite: suite.golden.parent.name)
def test_source_of_scenes_has_its_stored_digest(suite):
    versions = {name: find_version(name, suite.golden) for name in suite.names()}
    assert all(version is not None and version.golden for version in versions.values())
    edited = [name for name, version in versions.items() if version.tree != suite.tree(name)]
    assert not edited, "run `make seal`: it compares the images with the golden digests"


VARIANTS = [text for text in GOLDEN if ":" in text]
FIRST_VERSIONS = {
    "plain/target": "f7539512f62da8dd",
    "plain/target:light=0.5": "dee7681874ecf9db",
    "plain/target:occlusion=0.4": "4b7b297cb698fb47",
}
"""Fingerprints of first versions, which contain digests of source bytes and library versions."""


@pytest.mark.parametrize(
    "text",
    [pytest.param(text, marks=slow_if_unchanged(text.partition(":")[0])) for text in VARIANTS],
)
def test_variants_equal_the_golden_digests(text):
    golden, digests = GOLDEN[text], golden_digests(datasets.load(text))
    assert look_difference(golden["look"], digests["look"]) <= 1, "the pictures changed"
    assert (digests["truth"], digests["images"]) == (golden["truth"], golden["images"])


def test_describe_opens_no_unchanged_rendered_sequence(monkeypatch):
    opened = sequence_metadata(datasets.load("plain/target"))
    monkeypatch.setattr(SyntheticSuite, "load", lambda *_: pytest.fail("it was opened"))
    assert datasets.describe("plain/target") == opened
    monkeypatch.setattr(SyntheticSuite, "tree", lambda *_: "edited")
    with pytest.raises(pytest.fail.Exception, match="it was opened"):
        datasets.describe("plain/target")


def parse_specification(text):
    """Return suite, entry and parameters of a text without computing the ground truth."""
    name, options = parse_text(text)
    (suite,) = (suite for suite in SUITES if name in suite.names())
    return suite, suite.entries[name], suite.entries[name].parameters.checked(name, options)


def test_golden_keys_are_canonical():
    names = [
        parameters.canonical_name(entry.name)
        for _, entry, parameters in map(parse_specification, GOLDEN)
    ]
    assert names == list(GOLDEN)


@pytest.mark.parametrize(
    "version",
    [version for version in VERSIONS if len(version.golden) > 1],
    ids=lambda version: next(iter(version.golden)),
)
def test_scenes_differ_in_image_and_ground_truth(version):
    scenes = {text: parse_specification(text)[2].scene for text in version.golden}
    for first, second in itertools.combinations(version.golden, 2):
        if scenes[first] != scenes[second]:
            assert look_difference(*(version.golden[text]["look"] for text in (first, second))) > 20
            assert version.golden[first]["truth"] != version.golden[second]["truth"]
    assert len(set(scenes.values())) > 1


@pytest.fixture
def edited(monkeypatch):
    """Function that replaces the source digest of all scenes."""

    def edit(digest):
        monkeypatch.setattr("trackmark.datasets.synthetic.suite._scene_tree", lambda module: digest)

    return edit


def test_fingerprint_differs_between_variants():
    texts = [*FIRST_VERSIONS, "multipart/2", "multipart/1:scene=1"]
    fingerprints = {suite._fingerprint(*which) for suite, *which in map(parse_specification, texts)}
    assert len(fingerprints) == len(texts)


def test_fingerprint_changes_with_an_edited_source(edited):
    fingerprints = [datasets.load("plain/target").fingerprint]
    for digest in ("edited", "edited again"):
        edited(digest)
        fingerprints.append(datasets.load("plain/target").fingerprint)
    assert len(set(fingerprints)) == 3


def test_fingerprint_of_unchanged_source_depends_on_its_version(edited, monkeypatch):
    fingerprints = []
    for tree in ("one", "other"):
        edited(tree)
        version = VersionEntry([2], tree)
        monkeypatch.setattr(
            "trackmark.datasets.synthetic.suite.find_version",
            lambda name, file, version=version: version,
        )
        fingerprints.append(datasets.load("plain/target").fingerprint)
    assert fingerprints[0] == fingerprints[1]


@pytest.mark.parametrize(("text", "stored"), FIRST_VERSIONS.items())
def test_fingerprint_of_first_version_equals_stored_fingerprint(edited, text, stored):
    suite, entry, parameters = parse_specification(text)
    edited(find_version(entry.name, suite.golden).tree)
    assert suite._fingerprint(entry, parameters) == stored
