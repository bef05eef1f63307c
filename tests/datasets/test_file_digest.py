"""SHA-256 digests of files and their cache."""

import hashlib
import os
from pathlib import Path

import pytest

from trackmark.datasets import SequenceError
from trackmark.datasets.file_digest import cache_folder, file_digests

LONG_AGO = 1_000_000_000


@pytest.fixture
def files(tmp_path):
    """Three old files, as digests of recent files are not cached."""
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
