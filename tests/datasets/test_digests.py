"""Digests of source code and of files, and versions of scenes and trackers."""

import hashlib
import os
import sys
from importlib import metadata
from pathlib import Path

import pytest

from trackmark.datasets import SequenceError
from trackmark.datasets import source_digest as digests
from trackmark.datasets.file_digest import cache_folder, file_digests
from trackmark.datasets.source_digest import library_versions, source_digest
from trackmark.datasets.versioning import VersionEntry, find_version, read_versions, write_versions


@pytest.fixture
def package(tmp_path):
    """Package: `entry` imports `shared`, which imports `deep.leaf`; nothing imports `other`."""
    folder = tmp_path / "animals"
    (folder / "deep").mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "deep" / "__init__.py").write_text("")
    (folder / "entry.py").write_text("import numpy\nfrom animals.shared import thing\n")
    (folder / "shared.py").write_text("def thing():\n    import animals.deep.leaf\n")
    (folder / "deep" / "leaf.py").write_text("from animals import entry\nVALUE = 1\n")
    (folder / "other.py").write_text("VALUE = 1\n")
    return folder


@pytest.mark.parametrize("name", ["entry.py", "shared.py", "deep/leaf.py"])
def test_digest_depends_on_all_imported_modules(package, name):
    before, libraries = source_digest(package / "entry.py", package)
    assert libraries == {"numpy": metadata.version("numpy")}
    file = package / name
    file.write_text(file.read_text() + "changed = True\n")
    after, _ = source_digest(package / "entry.py", package)
    assert after != before


@pytest.mark.parametrize(
    ("text", "equal"),
    [
        ("# Comment.\nfrom animals.shared import (\n    thing\n)\nimport numpy\n", True),
        ("'A docstring.'\nimport numpy\nfrom animals.shared import thing\n", True),
        ("import numpy\nfrom .shared import thing\n", True),
        ("import numpy as n\nfrom animals.shared import thing\n", False),
        ("import numpy\nfrom animals.shared import thing as other\n", False),
        ("import numpy\nfrom animals.other import thing\n", False),
        ("import numpy\nfrom animals.shared import thing\nX = 'a text'\n", False),
    ],
)
def test_digest_depends_on_names_and_texts_not_on_comments(package, text, equal):
    before, _ = source_digest(package / "entry.py", package)
    (package / "entry.py").write_text(text)
    assert (source_digest(package / "entry.py", package)[0] == before) == equal


def test_digest_ignores_names_and_folders_of_modules(package):
    before, _ = source_digest(package / "entry.py", package)
    (package / "shared.py").rename(package / "deep" / "common.py")
    (package / "entry.py").write_text("import numpy\nfrom animals.deep.common import thing\n")
    assert source_digest(package / "entry.py", package)[0] == before


def test_digest_is_equal_on_all_python_versions(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("import os\n\ndef f(x, *, y=2.5):\n    return f'{x:>{y}}' + os.sep\n")
    assert source_digest(file, tmp_path / "none")[0] == "e09cabc51fda4f77"


def test_digest_ignores_other_modules_and_the_package_folder(package, tmp_path):
    before, _ = source_digest(package / "entry.py", package)
    (package / "other.py").write_text("VALUE = 2\n")
    (tmp_path / "elsewhere").mkdir()
    moved = package.rename(tmp_path / "elsewhere" / "animals")
    assert source_digest(moved / "entry.py", moved)[0] == before


def test_source_is_not_imported(package):
    (package / "shared.py").write_text("raise RuntimeError\n")
    source_digest(package / "entry.py", package)
    assert not any(name.startswith("animals") for name in sys.modules)


def test_distributions_equal_those_of_importlib():
    distributions = metadata.packages_distributions()
    imports = {name for name in distributions if name.isidentifier()}
    assert library_versions(imports | {"json", "no_such_library"}) == {
        name: metadata.version(name)
        for top in imports - sys.stdlib_module_names
        for name in distributions[top]
    }


def test_distribution_without_metadata_is_left_out(tmp_path, monkeypatch):
    """An interrupted installation leaves such folders."""
    broken = tmp_path / "broken-1.0.dist-info"
    broken.mkdir()
    (broken / "top_level.txt").write_text("numpy")
    (tmp_path / "mine.py").write_text("import numpy")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("_distributions", "_versions"):  # without their caches
        monkeypatch.setattr(digests, name, getattr(digests, name).__wrapped__)
    assert library_versions({"numpy"}) == {"numpy": metadata.version("numpy")}


def test_digest_of_outside_file_depends_on_its_imports(package, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("import animals.shared\n")
    before, _ = source_digest(file, package)
    (package / "deep" / "leaf.py").write_text("VALUE = 3\n")
    assert source_digest(file, package)[0] != before


LONG_AGO = 1_000_000_000


@pytest.fixture
def files(tmp_path):
    """Three old files; digests of recent files are not cached."""
    paths = [tmp_path / "a" / "1.bin", tmp_path / "a" / "2.bin", tmp_path / "b" / "1.bin"]
    for i, path in enumerate(paths):
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(bytes([i]) * 100)
        os.utime(path, (LONG_AGO, LONG_AGO))
    return paths


@pytest.fixture
def reads(monkeypatch):
    """Names of the files that are read for their digest."""
    opened = []
    digest = hashlib.file_digest

    def record(file, name):
        opened.append(Path(file.name).name)
        return digest(file, name)

    monkeypatch.setattr(hashlib, "file_digest", record)
    return opened


def test_digests_are_sha256_in_the_order_of_the_files(files):
    expected = [hashlib.sha256(bytes([i]) * 100).hexdigest() for i in (2, 0, 1)]
    assert file_digests([files[2], files[0], files[1]]) == expected


def test_unchanged_files_are_read_once(files, cache, reads):
    file_digests(files[:1])
    file_digests(files[:2])
    file_digests(files[:1])
    assert reads == ["1.bin", "2.bin"]
    assert {path.suffix for path in cache.rglob("*") if path.is_file()} == {".json"}


def test_changed_bytes_of_equal_size_are_noticed(files):
    before = file_digests(files)
    files[1].write_bytes(b"x" * 100)
    after = file_digests(files)
    assert after[1] != before[1]
    assert after[::2] == before[::2]


def test_recent_file_is_read_again(files, reads):
    files[0].write_bytes(b"y" * 100)
    now = files[0].stat().st_mtime_ns
    before = file_digests(files[:1])
    files[0].write_bytes(b"z" * 100)
    os.utime(files[0], ns=(now, now))  # as on a file system with a coarse clock
    assert file_digests(files[:1]) != before


def test_touched_file_is_read_again(files, reads):
    before = file_digests(files)
    os.utime(files[0], (LONG_AGO + 5, LONG_AGO + 5))
    assert file_digests(files) == before
    assert reads[3:] == ["1.bin"]


@pytest.mark.parametrize("damage", [b"", b"{", b'{"a": 1}', b'{"a": [1, 2, 3, 4]}', b"\xff\x00"])
def test_damaged_cache_is_replaced(files, cache, reads, damage):
    before = file_digests(files)
    (file,) = cache.rglob("*.json")
    file.write_bytes(damage)
    for _ in range(2):
        assert file_digests(files) == before
        assert len(reads) == 6


def test_digests_do_not_need_a_writable_cache(files, monkeypatch, tmp_path):
    blocked = tmp_path / "a file, so no folder can be made in it"
    blocked.write_text("")
    monkeypatch.setenv("TRACKMARK_CACHE", str(blocked))
    assert file_digests(files) == file_digests(files)


def test_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(SequenceError, match=r"gone\.jpg: cannot be read"):
        file_digests([tmp_path / "gone.jpg"])


def test_cache_folder_is_set_by_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("TRACKMARK_CACHE", str(tmp_path / "own"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "own"
    monkeypatch.delenv("TRACKMARK_CACHE")
    assert cache_folder() == tmp_path / "xdg" / "trackmark"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == tmp_path / "home" / ".cache" / "trackmark"


FIRST = VersionEntry(["abc", {"numpy": "2"}], "tree", {"suite/one": {"images": "12"}})


def test_version_identifies_only_the_stored_source():
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
