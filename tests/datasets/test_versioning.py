"""Versions of scenes and trackers in `golden.json` files."""

import pytest

from trackmark.datasets.versioning import VersionEntry, find_version, read_versions, write_versions

FIRST = VersionEntry(["abc", {"numpy": "2"}], "tree", {"suite/one": {"images": "12"}})


def test_version_identifies_the_stored_source_alone():
    assert FIRST.identity("tree") == ["abc", {"numpy": "2"}]
    assert FIRST.identity("edited") == ["abc", {"numpy": "2"}, "edited"]


def test_later_versions_are_numbers():
    assert FIRST.next_version() == [2]
    assert VersionEntry([2], "tree").next_version() == [3]


def test_written_versions_are_read_back(tmp_path):
    file = tmp_path / "golden.json"
    entries = {"suite/one": FIRST, "suite/clip-*": VersionEntry([2], "other", {}, ["numpy"])}
    write_versions(file, entries)
    assert read_versions(file) == entries
    assert find_version("suite/one", file) == FIRST
    assert find_version("suite/clip-07", file) == entries["suite/clip-*"]


@pytest.mark.parametrize("name", ["suite/two", "clip-07", "suite/on"])
def test_find_version_returns_none_without_an_entry(tmp_path, name):
    write_versions(tmp_path / "golden.json", {"suite/one": FIRST, "suite/clip-*": FIRST})
    assert find_version(name, tmp_path / "golden.json") is None
    assert find_version(name, tmp_path / "none.json") is None
    assert read_versions(tmp_path / "none.json") == {}
