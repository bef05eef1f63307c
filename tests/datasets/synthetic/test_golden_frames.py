"""Frames and truth of variants and their identities equal the golden ones.

See `datasets.versioning`.

As they are by default, sequences are held to their seals in `tests/datasets/test_conformance.py`.
"""

import itertools

import pytest

from tests.datasets.synthetic.scenes import unless_sealed
from trackmark import datasets
from trackmark.datasets.golden import golden_digests, look_difference
from trackmark.datasets.metadata import sequence_metadata
from trackmark.datasets.spec_string import parse_text
from trackmark.datasets.synthetic.suite import Suite, suites
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
"""Fingerprints of when they were digests of the source's bytes and the libraries' versions."""


@pytest.mark.parametrize(
    "text", [pytest.param(text, marks=unless_sealed(text.partition(":")[0])) for text in VARIANTS]
)
def test_variants_are_the_sealed_ones(text):
    sealed, found = GOLDEN[text], golden_digests(datasets.load(text))
    assert look_difference(sealed["look"], found["look"]) <= 1, "the pictures changed"
    assert (found["truth"], found["images"]) == (sealed["truth"], sealed["images"])


def test_a_description_opens_no_rendered_sequence_while_its_source_is_the_sealed_one(monkeypatch):
    opened = sequence_metadata(datasets.load("plain/target"))
    monkeypatch.setattr(Suite, "load", lambda *_: pytest.fail("it was opened"))
    assert datasets.describe("plain/target") == opened
    monkeypatch.setattr(Suite, "tree", lambda *_: "edited")
    with pytest.raises(pytest.fail.Exception, match="it was opened"):
        datasets.describe("plain/target")


def asked(text):
    """Suite, entry and knobs of a text; nothing is opened, which would compute the truth."""
    name, options = parse_text(text)
    (suite,) = (suite for suite in SUITES if name in suite.names())
    return suite, suite.entries[name], suite.entries[name].knobs.checked(name, options)


def test_the_texts_are_canonical():
    names = [knobs.canonical_name(entry.name) for _, entry, knobs in map(asked, GOLDEN)]
    assert names == list(GOLDEN)


@pytest.mark.parametrize(
    "seal",
    [seal for seal in SEALS if len(seal.golden) > 1],
    ids=lambda seal: next(iter(seal.golden)),
)
def test_another_scene_is_another_picture_and_another_truth(seal):
    scenes = {text: asked(text)[2].scene for text in seal.golden}
    for one, other in itertools.combinations(seal.golden, 2):
        if scenes[one] != scenes[other]:
            assert look_difference(*(seal.golden[text]["look"] for text in (one, other))) > 20
            assert seal.golden[one]["truth"] != seal.golden[other]["truth"]
    assert len(set(scenes.values())) > 1


@pytest.mark.parametrize("suite", SUITES, ids=lambda suite: suite.golden.parent.name)
def test_every_sequence_has_a_seal(suite):
    seals = [find_version(name, suite.golden) for name in suite.names()]
    assert all(seal is not None and seal.golden for seal in seals)


class TestFingerprint:
    """What tells variants and versions of a scene apart, and nothing else."""

    @pytest.fixture
    def edited(self, monkeypatch):
        """Act as if the source of all scenes were another."""

        def edit(digest):
            monkeypatch.setattr(
                "trackmark.datasets.synthetic.suite._scene_tree", lambda module: digest
            )

        return edit

    def test_it_differs_between_variants_and_sequences(self):
        texts = [*FIRST_VERSIONS, "multipart/2", "multipart/1:scene=1"]
        found = {suite._fingerprint(*which) for suite, *which in map(asked, texts)}
        assert len(found) == len(texts)

    def test_an_edited_source_never_mixes_with_the_sealed_one(self, edited):
        found = [datasets.load("plain/target").fingerprint]
        for digest in ("edited", "edited again"):
            edited(digest)
            found.append(datasets.load("plain/target").fingerprint)
        assert len(set(found)) == 3

    def test_the_version_alone_names_a_sealed_source(self, edited, monkeypatch):
        found = []
        for tree in ("one", "other"):
            edited(tree)
            seal = VersionEntry([2], tree)
            monkeypatch.setattr(
                "trackmark.datasets.synthetic.suite.find_version",
                lambda name, file, seal=seal: seal,
            )
            found.append(datasets.load("plain/target").fingerprint)
        assert found[0] == found[1]

    @pytest.mark.parametrize(("text", "stored"), FIRST_VERSIONS.items())
    def test_a_first_version_has_the_one_that_results_were_stored_under(self, edited, text, stored):
        suite, entry, knobs = asked(text)
        edited(find_version(entry.name, suite.golden).tree)
        assert suite._fingerprint(entry, knobs) == stored
