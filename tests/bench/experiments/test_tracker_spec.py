"""Trackers as the harness names, seeds and versions them."""

import functools
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from tests.trackers.tiny_models import write_models
from trackmark.bench.experiments import tracker_spec as module
from trackmark.bench.experiments.tracker_files import settled
from trackmark.bench.experiments.tracker_spec import (
    PACKAGE,
    contestant,
    contestants,
    identify,
    run_seed,
)
from trackmark.datasets.source_digest import source_digest
from trackmark.datasets.versioning import Seal
from trackmark.trackers import TrackerError

TREE = "0123456789abcdef"
PLUGIN = '''
"""A tracker of my own."""
from trackmark.trackers.base.interface import Estimate, TrackerPlugin

class Own(TrackerPlugin):
    """Stays."""

    def init(self, image, box, mask=None):
        self.box = box

    def update(self, image):
        return Estimate(self.box)
'''


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
def test_what_is_the_same_has_the_same_label(text, label):
    chosen = contestant(text)
    assert chosen.label == label
    assert contestant(chosen.label).label == label
    assert contestant(chosen.label).parameters == chosen.parameters


@pytest.mark.parametrize(
    "text", ["camshift:window", "camshift:=3", "camshift:window=fixed:window=fixed"]
)
def test_a_malformed_text_is_refused(text):
    with pytest.raises(TrackerError, match="camshift"):
        contestant(text)


def test_the_seed_ignores_parameters_and_depends_on_everything_else():
    def state(*arguments):
        return run_seed(*arguments).generate_state(4).tolist()

    base = state("a", "s", 0)
    assert contestant("camshift:hue_bins=8").name == "camshift"
    assert base == state("a", "s", 0)
    assert all(
        base != other for other in (state("b", "s", 0), state("a", "t", 0), state("a", "s", 1))
    )
    expected = np.random.SeedSequence(5, spawn_key=(0xE8B7BE43, 0x71BEEFF9))  # crc32 of "a", "b"
    assert state("a", "b", 5) == expected.generate_state(4).tolist()


def test_a_tracker_in_a_file_is_named_by_file_and_class(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(PLUGIN)
    chosen = contestant(f"{file}:Own")
    assert chosen.label == chosen.name == "own.py:Own"
    assert chosen.file == file


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("{}", "own.py:Own"),
        ("{}:", "own.py:Own"),
        ("{}:as=mine", "mine"),
        ("{}:Own:init=full:as=mine", "mine:init=full"),
        ("{}:step=2", "own.py:Own:step=2"),
        ("{}:Own:as=mine:step=2", "mine:step=2"),
    ],
)
def test_a_tracker_in_a_file_may_be_named_and_needs_no_class_where_there_is_one(
    tmp_path, text, label
):
    (tmp_path / "a.python").mkdir()
    file = tmp_path / "a.python" / "own.py"
    steps = "class Steps(Parameters):\n    step: int = 1\n\n"
    code = PLUGIN.replace(
        "class Own", f"from trackmark.trackers import Parameters\n{steps}class Own"
    )
    file.write_text(code.replace('"""Stays."""', "Parameters = Steps"))
    chosen = contestant(text.format(file))
    assert chosen.label == label
    assert chosen.name == label.partition(":init")[0].partition(":step")[0]
    assert chosen.file == file


def test_two_classes_of_one_file_under_one_name_are_two_versions(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(PLUGIN + PLUGIN.replace("class Own", "class Other"))
    one, other = contestants([f"{file}:Own:as=mine", f"{file}:Other:as=mine"]).values()
    assert one.label == other.label == "mine"
    assert one.version != other.version
    assert contestant(f"{file}:Own").version["source"] == source_digest(file, PACKAGE)[0]


def test_a_built_in_tracker_keeps_its_name():
    with pytest.raises(TrackerError, match="unknown parameter of camshift 'as'"):
        contestant("camshift:as=mine")


def test_the_version_changes_with_the_source_of_the_tracker(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(PLUGIN)
    before = contestant(f"{file}:Own").version
    file.write_text(PLUGIN + "\n# a comment\n")
    assert contestant(f"{file}:Own").version == before
    file.write_text(PLUGIN + "\nchanged = True\n")
    after = contestant(f"{file}:Own").version
    assert before["source"] != after["source"]
    assert before["libraries"] == after["libraries"]
    assert "numpy" in before["libraries"]


def test_a_sealed_tracker_is_known_by_its_version_while_its_source_is_the_sealed_one(monkeypatch):
    monkeypatch.setattr(module, "seal_of", lambda name, file: Seal(["first"], TREE, {}, ["numpy"]))
    monkeypatch.setattr(module, "source_digest", lambda file, package: (TREE, {"scipy": "1"}))
    numpy = {"numpy": metadata.version("numpy")}
    assert contestant("camshift").version == {"source": "first", "libraries": numpy}
    monkeypatch.setattr(module, "source_digest", lambda file, package: ("edited", {}))
    assert contestant("camshift").version == {"source": "first-edited", "libraries": numpy}


def test_a_tracker_outside_has_no_seal_even_under_a_built_in_name(tmp_path):
    file = tmp_path / "static.py"
    file.write_text(PLUGIN)
    own = contestant(f"{file}:Own").version["source"]
    assert own == source_digest(file, PACKAGE)[0]


@pytest.mark.parametrize(
    ("statement", "file"),
    [
        ("import helper", "helper.py"),
        ("from helper import OFFSET", "helper.py"),
        ("from parts.deep import x", "parts/deep.py"),
        ("from trackmark.trackers.base import sharing", None),
    ],
)
def test_the_version_follows_modules_beside_the_file(tmp_path, statement, file):
    (tmp_path / "helper.py").write_text("OFFSET = 1\n")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "deep.py").write_text("x = 1\n")
    own = tmp_path / "own.py"
    own.write_text(f"{statement}\n")
    before = source_digest(own, PACKAGE)
    for changed in ("helper.py", "parts/deep.py"):
        text = (tmp_path / changed).read_text()
        (tmp_path / changed).write_text(f"{text}changed = 1\n")
        assert (source_digest(own, PACKAGE) != before) == (changed == file)
        (tmp_path / changed).write_text(text)


def test_the_version_follows_relative_imports_within_a_package(tmp_path):
    package = tmp_path / "mine"
    (package / "sub").mkdir(parents=True)
    for folder in (package, package / "sub"):
        (folder / "__init__.py").write_text("")
    (package / "tool.py").write_text("a = 1\n")
    (package / "sub" / "near.py").write_text("b = 1\n")
    own = package / "sub" / "own.py"
    own.write_text("from ..tool import a\nfrom . import near\n")
    before = source_digest(own, PACKAGE)
    for changed in (package / "tool.py", package / "sub" / "near.py"):
        text = changed.read_text()
        changed.write_text(f"{text}changed = 1\n")
        assert source_digest(own, PACKAGE) != before
        changed.write_text(text)
    assert source_digest(own, PACKAGE) == before


def test_a_callable_is_named_by_its_qualified_name():
    def maker(seed):
        raise NotImplementedError

    assert contestant(maker).label.endswith("<locals>.maker")
    assert contestant(maker).version["source"] != "unknown"
    assert contestant(functools.partial(maker)).label == "partial"


LATE = """
from trackmark.trackers.base.interface import TrackerPlugin
from trackmark.trackers.base.opencv import OpenCVParameters


class Settings(OpenCVParameters):
    threshold: float = 0.5


class Late(TrackerPlugin):
    presets = {"usual": {}, "recommended": {"threshold": 0.0}}
    default_preset = "usual"
    Parameters = Settings

    def init(self, image, box, mask=None): ...

    def update(self, image): ...
"""


class Data:
    name, fingerprint = "somewhere", "0"


def test_parameters_that_came_later_are_no_part_of_what_identifies_a_run_by_default(tmp_path):
    file = tmp_path / "late.py"
    file.write_text(LATE)
    told = [f"{file}", f"{file}:preset=usual", f"{file}:threshold=0.5"]
    both = [contestant(text) for text in told] + list(settled(told).values())
    for chosen in both:
        assert chosen.label == "late.py:Late"
        assert chosen.parameters == {"threshold": 0.5}
        known = identify(chosen, Data, 0)
        # As it was before it had parameters, or another preset.
        assert (known.preset, known.parameters) == ("recommended", {})
    other = contestant(f"{file}:preset=recommended")
    assert other.label == "late.py:Late:preset=recommended"
    assert identify(other, Data, 0).parameters == {"threshold": 0.0}


def test_another_model_under_the_same_name_makes_other_runs(tmp_path):
    model = Path(write_models(tmp_path)["opencv-vit"]["net"])
    content = model.read_bytes()

    def version(text=f"opencv-vit:net={model}"):
        chosen = contestant(text)
        assert chosen.label == text
        return identify(chosen, Data, 0).version

    first = version()
    assert version() == first
    model.write_bytes(content + b"\0")
    assert version() != first
    model.write_bytes(content)
    assert version() == first
