"""SHA-256 digests of files, cached on disk by path, size and modification time."""

import functools
import hashlib
import os
import time
from collections import abc
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from pydantic import TypeAdapter, ValidationError

from trackmark.datasets.interface import SequenceError

TICK_NS = 2_000_000_000
"""Coarsest step of modification times among file systems, which is that of FAT [ns].

Two changes within this time can have equal modification times. Digests of files that changed so
recently are therefore not cached.
"""

_Entries = dict[str, tuple[int, int, str]]  # size, modification time [ns] and digest by path
_ENTRIES = TypeAdapter(_Entries)


def file_stamp(file: Path | os.DirEntry[str]) -> tuple[int, int]:
    """Return size [bytes] and modification time [ns], by which changes are noticed."""
    status = file.stat()
    return status.st_size, status.st_mtime_ns


def cache_folder() -> Path:
    """Return the folder of cached results: `$TRACKMARK_CACHE`, or a folder in the user's cache."""
    folder = os.environ.get("TRACKMARK_CACHE")
    if folder:
        return Path(folder).expanduser()
    user = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(user).expanduser() / "trackmark"


def file_digests(files: abc.Sequence[Path]) -> list[str]:
    """Return the SHA-256 digests of files in hexadecimal.

    A file is read only if its size or modification time differs from the cached values. A damaged
    cache is replaced. If the cache cannot be written, the files are read again next time.

    Raises `SequenceError` for a file that cannot be read.
    """
    # Not `Path.resolve`: it raises RuntimeError if symbolic links form a loop. Each folder is
    # resolved once, as it can hold thousands of files.
    real = functools.cache(os.path.realpath)
    paths = [
        Path(os.path.realpath(file)) if file.is_symlink() else Path(real(file.parent), file.name)
        for file in files
    ]
    # There is one cache file per set of folders, so that each cache file is small.
    folders = "\0".join(sorted({str(path.parent) for path in paths}))
    cache = cache_folder() / "digests" / f"{hashlib.sha256(folders.encode()).hexdigest()[:16]}.json"
    try:
        cached = _ENTRIES.validate_json(cache.read_bytes())
    except (OSError, ValidationError):
        cached = {}
    added: _Entries = {}
    digests = []
    for path in paths:
        try:
            stamp = file_stamp(path)
            cached_file = cached.get(str(path))
            if cached_file is not None and cached_file[:2] == stamp:
                digest = cached_file[2]
            else:
                with path.open("rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
                if time.time_ns() - stamp[1] > TICK_NS:
                    added[str(path)] = (*stamp, digest)
        except OSError as error:
            raise SequenceError(f"{path}: cannot be read ({error}).") from error
        digests.append(digest)
    if added:
        write_cache(cache, _ENTRIES.dump_json(cached | added))
    return digests


def write_cache(cache: Path, payload: bytes) -> None:
    """Write or replace a cache file as a whole; do nothing if it cannot be written."""
    with suppress(OSError):
        cache.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=cache.parent, delete=False) as file:
            file.write(payload)
        Path(file.name).replace(cache)
