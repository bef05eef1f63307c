"""Labels, seeds, versions and identities of trackers."""

import functools
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from tests.trackers.tiny_models import write_models
from trackmark.bench.experiments import tracker_spec as module
from trackmark.bench.experiments.tracker_spec import (
    PACKAGE,
    built_in_digest,
    parse_tracker,
    run_identity,
)
from trackmark.datasets.source_digest import source_digest
from trackmark.datasets.versioning import VersionEntry
from trackmark.trackers import TrackerError
from trackmark.trackers.base.catalogue import run_seed

TREE = "0123456789abcdef"
PLUGIN = '''
"""A tracker of my own."""
from trackmark.trackers import Parameters
from trackmark.trackers.base.interface import Estimate, TrackerPlugin

class Steps(Parameters):
    step: int = 1

class Own(TrackerPlugin):
    Parameters = Steps

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        return Estimate(self.box)
'''


class Data:
    name, fingerprint = "somewhere", "0"


@pytest.fixture
def tracker_file(tmp_path):
    """Write a file with one tracker."""
    (tmp_path / "a.python").mkdir()
    file = tmp_path / "a.python" / "own.py"
    file.write_text(PLUGIN)
    return file


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("camshift", "camshift"),
        (" camshift ", "camshift"),
        ("camshift:window=fixed", "camshift"),
        ("camshift:window=adaptive", "camshift:window=adaptive"),
        ("camshift:preset=recommended:hue_bins=032", "camshift"),
        ("camshift:window=adaptive:hue_bins=16", "camshift:hue_bins=16:window=adaptive"),
        ("camshift:preset=as-written", "camshift:preset=as-written"),
    ],
)
def test_equal_trackers_have_equal_labels(text, label):
    spec = parse_tracker(text)
    assert spec.label == label
    assert parse_tracker(spec.label).label == label
    assert parse_tracker(spec.label).parameters == spec.parameters


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camshift:window", "camshift"),
        ("camshift:=3", "camshift"),
        ("camshift:window=fixed:window=fixed", "camshift"),
        ("camshift:as=mine", "unknown parameter of camshift 'as'"),
    ],
)
def test_malformed_specification_is_refused(text, message):
    with pytest.raises(TrackerError, match=message):
        parse_tracker(text)


def test_seed_depends_on_names_and_repetition_only():
    def state(*arguments):
        return run_seed(*arguments).generate_state(4).tolist()

    base = state("a", "s", 0)
    assert parse_tracker("camshift:hue_bins=8").name == "camshift"
    assert base == state("a", "s", 0)
    for other in (("b", "s", 0), ("a", "t", 0), ("a", "s", 1)):
        assert state(*other) != base
    expected = np.random.SeedSequence(5, spawn_key=(0xE8B7BE43, 0x71BEEFF9))  # crc32 of "a", "b"
    assert state("a", "b", 5) == expected.generate_state(4).tolist()


@pytest.mark.parametrize(
    ("options", "label"),
    [
        ("", "own.py:Own"),
        (":", "own.py:Own"),
        (":Own", "own.py:Own"),
        (":as=mine", "mine"),
        (":Own:init=full:as=mine", "mine:init=full"),
        (":step=2", "own.py:Own:step=2"),
        (":Own:as=mine:step=2", "mine:step=2"),
    ],
)
def test_tracker_in_a_file_has_a_label_of_file_class_and_name(tracker_file, options, label):
    spec = parse_tracker(f"{tracker_file}{options}")
    assert spec.label == label
    assert spec.name == label.partition(":init")[0].partition(":step")[0]
    assert spec.file == tracker_file


def test_classes_of_one_file_have_different_versions(tracker_file):
    tracker_file.write_text(PLUGIN + PLUGIN.replace("class Own", "class Other"))
    first, second = (parse_tracker(f"{tracker_file}:{name}:as=mine") for name in ("Own", "Other"))
    assert first.label == second.label == "mine"
    assert first.version != second.version
    assert (
        parse_tracker(f"{tracker_file}:Own").version["source"]
        == source_digest(tracker_file, PACKAGE)[0]
    )


def test_version_changes_with_the_source_of_the_tracker(tracker_file):
    before = parse_tracker(f"{tracker_file}:Own").version
    tracker_file.write_text(PLUGIN + "\n# a comment\n")
    assert parse_tracker(f"{tracker_file}:Own").version == before
    tracker_file.write_text(PLUGIN + "\nchanged = True\n")
    after = parse_tracker(f"{tracker_file}:Own").version
    assert before["source"] != after["source"]
    assert before["libraries"] == after["libraries"]
    assert "numpy" in before["libraries"]


def test_sealed_tracker_keeps_version_until_source_changes(monkeypatch):
    entry = VersionEntry(["first"], TREE, {}, ["numpy"])
    monkeypatch.setattr(module, "find_version", lambda name, file: entry)
    monkeypatch.setattr(module, "source_digest", lambda file, package: (TREE, {"scipy": "1"}))
    numpy = {"numpy": metadata.version("numpy")}
    assert parse_tracker("camshift").version == {"source": "first", "libraries": numpy}
    monkeypatch.setattr(module, "source_digest", lambda file, package: ("edited", {}))
    assert parse_tracker("camshift").version == {"source": "first-edited", "libraries": numpy}


def test_built_in_digest_is_that_of_the_imported_tracker():
    for name in ("static", "opencv-mil"):
        assert built_in_digest(name) == run_identity(parse_tracker(name), Data, 0).tracker_version
    assert built_in_digest("knob.py:Knob") is None


def test_tracker_in_a_file_has_no_seal_under_a_built_in_name(tracker_file):
    file = tracker_file.rename(tracker_file.with_name("static.py"))
    version = parse_tracker(f"{file}:Own").version["source"]
    assert version == source_digest(file, PACKAGE)[0]


def test_callable_has_its_qualified_name_as_label():
    def maker(seed):
        raise NotImplementedError

    assert parse_tracker(maker).label.endswith("<locals>.maker")
    assert parse_tracker(maker).version["source"] != "unknown"
    assert parse_tracker(functools.partial(maker)).label == "partial"


def test_identity_changes_with_the_content_of_a_model_file(tmp_path):
    model = Path(write_models(tmp_path)["opencv-vit"]["net"])
    content = model.read_bytes()

    def version():
        return run_identity(parse_tracker(f"opencv-vit:net={model}"), Data, 0).version

    first = version()
    model.write_bytes(content + b"\0")
    assert version() != first
    model.write_bytes(content)
    assert version() == first
