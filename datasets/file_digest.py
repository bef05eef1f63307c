"""SHA-256 of files, remembered between runs by path, size and time of change."""

import functools
import hashlib
import os
import time
from collections.abc import Sequence as SequenceOf
from contextlib import suppress
from pathlib import Path
from tempfile import NamedTemporaryFile

from pydantic import TypeAdapter, ValidationError

from trackmark.datasets.interface import SequenceError

# Two changes within one tick of the file system's clock leave the same time of change; a
# file changed so recently is not remembered (2 s is FAT's tick, the coarsest).
TICK_NS = 2_000_000_000

_Known = dict[str, tuple[int, int, str]]  # size and time of change [ns], digest, by path
_KNOWN = TypeAdapter(_Known)


def cache_folder() -> Path:
    """Folder for what can be had again: `$TRACKMARK_CACHE`, or one in the user's cache."""
    own = os.environ.get("TRACKMARK_CACHE")
    if own:
        return Path(own).expanduser()
    user = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(user).expanduser() / "trackmark"


def file_digests(files: SequenceOf[Path]) -> list[str]:
    """SHA-256 of files, in hexadecimal.

    A file is read only when its size or time of change differs from the remembered ones. A
    cache that is damaged is made anew, one that can't be written only costs time.

    Raises `SequenceError` for a file that can't be read.
    """
    # Not `Path.resolve`: it raises RuntimeError if symbolic links form a loop. Each folder is
    # resolved once, as it can hold thousands of files.
    real = functools.cache(os.path.realpath)
    paths = [
        Path(os.path.realpath(file)) if file.is_symlink() else Path(real(file.parent), file.name)
        for file in files
    ]
    # One cache file a set of folders keeps each small, and runs on other data out of it.
    folders = "\0".join(sorted({str(path.parent) for path in paths}))
    cache = cache_folder() / "digests" / f"{hashlib.sha256(folders.encode()).hexdigest()[:16]}.json"
    known = _remembered(cache)
    fresh: _Known = {}
    digests = []
    for path in paths:
        try:
            status = path.stat()
            stamp = (status.st_size, status.st_mtime_ns)
            entry = known.get(str(path))
            if entry is not None and entry[:2] == stamp:
                digest = entry[2]
            else:
                with path.open("rb") as file:
                    digest = hashlib.file_digest(file, "sha256").hexdigest()
                if time.time_ns() - status.st_mtime_ns > TICK_NS:
                    fresh[str(path)] = (*stamp, digest)
        except OSError as error:
            raise SequenceError(f"{path}: can't be read ({error}).") from error
        digests.append(digest)
    if fresh:
        with suppress(OSError):
            _remember(cache, known | fresh)
    return digests


def _remembered(cache: Path) -> _Known:
    try:
        return _KNOWN.validate_json(cache.read_bytes())
    except (OSError, ValidationError):
        return {}


def _remember(cache: Path, known: _Known) -> None:
    cache.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile(dir=cache.parent, delete=False) as file:
        file.write(_KNOWN.dump_json(known))
    Path(file.name).replace(cache)
