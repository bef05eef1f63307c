"""Seals: what names the version of a scene or of a tracker."""

import pytest

from trackmark.datasets.versioning import Seal, read_seals, seal_of, write_seals

FIRST = Seal(["abc", {"numpy": "2"}], "tree", {"suite/one": {"images": "12"}})


def test_a_sealed_tree_is_named_by_the_version_alone():
    assert FIRST.named("tree") == ["abc", {"numpy": "2"}]


def test_another_tree_joins_the_version():
    assert FIRST.named("edited") == ["abc", {"numpy": "2"}, "edited"]
    assert FIRST.named("edited") != FIRST.named("edited again")


def test_later_versions_are_numbers():
    assert FIRST.next_version() == [2]
    assert Seal([2], "tree").next_version() == [3]


def test_what_is_written_is_read_again(tmp_path):
    file = tmp_path / "golden.json"
    seals = {"suite/one": FIRST, "suite/clip-*": Seal([2], "other", {}, ["numpy"])}
    write_seals(file, seals)
    assert read_seals(file) == seals
    assert seal_of("suite/one", file) == FIRST
    assert seal_of("suite/clip-07", file) == seals["suite/clip-*"]


@pytest.mark.parametrize("name", ["suite/two", "clip-07", "suite/on"])
def test_what_has_no_seal_has_none(tmp_path, name):
    write_seals(tmp_path / "golden.json", {"suite/one": FIRST, "suite/clip-*": FIRST})
    assert seal_of(name, tmp_path / "golden.json") is None
    assert seal_of(name, tmp_path / "none.json") is None
    assert read_seals(tmp_path / "none.json") == {}
