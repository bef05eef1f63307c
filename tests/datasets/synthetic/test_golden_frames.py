"""Frames, ground truth and identities of variants, compared with the golden digests.

Sequences with default parameters are compared in `tests/datasets/test_conformance.py`. See
`datasets.versioning`.
"""

import itertools

import pytest

from tests.datasets.synthetic.scenes import unless_sealed
from trackmark import datasets
from trackmark.datasets.golden import golden_digests, look_difference
from trackmark.datasets.metadata import sequence_metadata
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.suite import SyntheticSuite, suites
from trackmark.datasets.versioning import VersionEntry, find_version, read_versions

SUITES = suites()
SEALS = [seal for suite in SUITES for seal in read_versions(suite.golden).values()]
GOLDEN = {text: golden for seal in SEALS for text, golden in seal.golden.items()}
VARIANTS = [text for text in GOLDEN if ":" in text]
FIRST_VERSIONS = {
    "plain/target": "f7539512f62da8dd",
    "plain/target:light=0.5": "dee7681874ecf9db",
    "plain/target:occlusion=0.4": "4b7b297cb698fb47",
}
"""Fingerprints of first versions: digests of the source's bytes and the libraries' versions."""


@pytest.mark.parametrize(
    "text", [pytest.param(text, marks=unless_sealed(text.partition(":")[0])) for text in VARIANTS]
)
def test_variants_equal_the_golden_digests(text):
    sealed, digests = GOLDEN[text], golden_digests(datasets.load(text))
    assert look_difference(sealed["look"], digests["look"]) <= 1, "the pictures changed"
    assert (digests["truth"], digests["images"]) == (sealed["truth"], sealed["images"])


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
    "seal",
    [seal for seal in SEALS if len(seal.golden) > 1],
    ids=lambda seal: next(iter(seal.golden)),
)
def test_scenes_differ_in_image_and_ground_truth(seal):
    scenes = {text: parse_specification(text)[2].scene for text in seal.golden}
    for first, second in itertools.combinations(seal.golden, 2):
        if scenes[first] != scenes[second]:
            assert look_difference(*(seal.golden[text]["look"] for text in (first, second))) > 20
            assert seal.golden[first]["truth"] != seal.golden[second]["truth"]
    assert len(set(scenes.values())) > 1


@pytest.mark.parametrize("suite", SUITES, ids=lambda suite: suite.golden.parent.name)
def test_every_sequence_has_a_version(suite):
    seals = [find_version(name, suite.golden) for name in suite.names()]
    assert all(seal is not None and seal.golden for seal in seals)


class TestFingerprint:
    """Fingerprint: identifies variants and versions of a scene."""

    @pytest.fixture
    def edited(self, monkeypatch):
        """Act as if the source of all scenes were another."""

        def edit(digest):
            monkeypatch.setattr(
                "trackmark.datasets.synthetic.suite._scene_tree", lambda module: digest
            )

        return edit

    def test_fingerprint_differs_between_variants(self):
        texts = [*FIRST_VERSIONS, "multipart/2", "multipart/1:scene=1"]
        fingerprints = {
            suite._fingerprint(*which) for suite, *which in map(parse_specification, texts)
        }
        assert len(fingerprints) == len(texts)

    def test_fingerprint_changes_with_an_edited_source(self, edited):
        fingerprints = [datasets.load("plain/target").fingerprint]
        for digest in ("edited", "edited again"):
            edited(digest)
            fingerprints.append(datasets.load("plain/target").fingerprint)
        assert len(set(fingerprints)) == 3

    def test_fingerprint_of_unchanged_source_is_its_version(self, edited, monkeypatch):
        fingerprints = []
        for tree in ("one", "other"):
            edited(tree)
            seal = VersionEntry([2], tree)
            monkeypatch.setattr(
                "trackmark.datasets.synthetic.suite.find_version",
                lambda name, file, seal=seal: seal,
            )
            fingerprints.append(datasets.load("plain/target").fingerprint)
        assert fingerprints[0] == fingerprints[1]

    @pytest.mark.parametrize(("text", "stored"), FIRST_VERSIONS.items())
    def test_fingerprint_of_first_version_is_stored_one(self, edited, text, stored):
        suite, entry, parameters = parse_specification(text)
        edited(find_version(entry.name, suite.golden).tree)
        assert suite._fingerprint(entry, parameters) == stored
