"""Download of data sets from the plain addresses that their toolkits use.

`download_sources.toml` has the addresses. An archive grows in a file `….part`, at whose end an
interrupted download continues. A sequence is unpacked next to its folder, which therefore is
complete if it exists. `downloads.txt` in the target folder has the checksums of all archives, with
which later downloads are compared.
"""

import json
import tomllib
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import urljoin
from zipfile import BadZipFile, ZipFile

import pooch
import requests

from trackmark.datasets.interface import SequenceError
from trackmark.datasets.spec_string import name_hint

SOURCES = Path(__file__).with_name("download_sources.toml")
CHECKSUMS = "downloads.txt"
TIMEOUT = 60.0
"""Maximum time without data from a server [s]."""

_CHUNK = 1 << 16  # bytes; an interrupted download loses less than this
_ALGORITHMS = {32: "md5", 40: "sha1", 64: "sha256"}  # by the number of hexadecimal digits


class DownloadError(SequenceError):
    """Failed download; the message names the address and the remedy."""


class BrokenConnectionError(DownloadError):
    """Failed connection, which other downloads from the same server would need, too."""


@dataclass(frozen=True)
class Source:
    """Entry of `download_sources.toml`; `names` and one of the addresses are empty if unknown."""

    page: str
    size: str
    evidence: str = ""  # repository, commit and file with the address
    archives: str = ""
    description: str = ""
    names: str = ""
    steps: str = ""  # what a user does who downloads by hand


@dataclass(frozen=True)
class Archive:
    """ZIP file of a sequence: address, subfolder to which it is unpacked, checksum if known."""

    url: str
    folder: str = ""
    checksum: str | None = None


@dataclass(frozen=True)
class Item:
    """Sequence or folder of sequences that is downloaded as a whole."""

    name: str
    archives: list[Archive]
    fields: Mapping[str, str] = field(default_factory=dict)  # of VOT's file `sequence`


def read_sources() -> dict[str, Source]:
    """Return all sources by the name of the data set."""
    return {name: Source(**entry) for name, entry in tomllib.loads(SOURCES.read_text()).items()}


def find_items(source: Source, names: Sequence[str], to: Path) -> list[Item]:
    """Return the named items of a source, or all; download the description of VOT to `to`.

    Raises `DownloadError` for an unknown name and for an unreadable description.
    """
    if source.description:
        file = to / ".description.json"
        try:
            _fetch(source, source.description, file, None)
            encoded = file.read_bytes()
        finally:  # a description can change: it is not continued
            file.unlink(missing_ok=True)
            _partial_file(file).unlink(missing_ok=True)
        try:
            items = list(_vot_items(json.loads(encoded), source.description))
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise DownloadError(
                f"{source.description}: this is no description of a VOT data set ({error!r}). See "
                f"{source.page}"
            ) from None
    else:
        items = [
            Item(name, [Archive(source.archives.format(name=name))])
            for name in source.names.split()
        ]
    by_name = {item.name: item for item in items}
    for name in names:
        if name not in by_name:
            raise DownloadError(f"unknown name {name!r}.{name_hint(name, by_name)}")
    return [by_name[name] for name in dict.fromkeys(names)] if names else items


def download(source: Source, item: Item, to: Path, on_progress: Callable[[int, int], None]) -> bool:
    """Download and unpack an item; return False if its folder exists.

    `on_progress` is called with the number of received bytes of an archive and its length.

    Raises
    ------
    DownloadError
        If an address does not work, the connection ends, or the archive is damaged.
    OSError
        If the folder cannot be written, for example because the disk is full.
    """
    folder = to / item.name
    if folder.exists():
        return False
    files = [to / _file_name(item, archive) for archive in item.archives]
    for archive, file in zip(item.archives, files, strict=True):
        _fetch(source, archive.url, file, archive.checksum, on_progress)
    with TemporaryDirectory(dir=to, prefix=".") as name:
        unpacked = Path(name) / item.name
        for archive, file in zip(item.archives, files, strict=True):
            _unpack(file, unpacked / archive.folder, archive.url)
        if item.fields:
            lines = [f"{key}={value}\n" for key, value in item.fields.items()]
            (unpacked / "sequence").write_text("".join(lines))
        _only_folder(unpacked).rename(folder)
    for file in files:
        file.unlink()
    return True


def _vot_items(description: Any, url: str) -> Iterator[Item]:
    """Yield the sequences of a `description.json`; addresses in it are relative to its own."""
    for about in description["sequences"]:
        name = str(about["name"])
        if Path(name).name != name:
            raise ValueError(f"name {name!r}")
        channels = {"": about["annotations"], **about["channels"]}
        fields = {"name": name, "fps": str(about["fps"]), "format": "default"}
        for channel, about_channel in about["channels"].items():
            fields[f"channels.{channel}"] = f"{channel}/{about_channel.get('pattern', '')}"
        archives = [
            Archive(
                urljoin(url, about_channel["url"]),
                channel,
                _known_hash(about_channel.get("checksum")),
            )
            for channel, about_channel in channels.items()
        ]
        yield Item(name, archives, fields)


def _known_hash(checksum: object) -> str | None:
    """Return a checksum as Pooch expects it; None if its algorithm is unknown."""
    digits = str(checksum or "")
    return f"{_ALGORITHMS[len(digits)]}:{digits}" if len(digits) in _ALGORITHMS else None


def _file_name(item: Item, archive: Archive) -> str:
    return f"{item.name}-{archive.folder}.zip" if archive.folder else f"{item.name}.zip"


def _fetch(
    source: Source,
    url: str,
    file: Path,
    known_hash: str | None,
    on_progress: Callable[[int, int], None] = lambda *_: None,
) -> None:
    """Download a file, unless it exists, and compare its checksum with that of the first time."""
    registry = pooch.create(path=file.parent, base_url="")
    checksums = file.parent / CHECKSUMS
    if checksums.exists():
        registry.load_registry(checksums)
    is_archive = file.suffix == ".zip"
    first_time = is_archive and file.name not in registry.registry
    with _explained(source, url, file):
        pooch.retrieve(
            url,
            known_hash or (registry.registry.get(file.name) if is_archive else None),
            fname=file.name,
            path=file.parent,
            downloader=partial(_resume, partial_file=_partial_file(file), on_progress=on_progress),
        )
    if first_time:
        with checksums.open("a") as lines:
            lines.write(f"{file.name} {pooch.file_hash(file)}\n")


def _partial_file(file: Path) -> Path:
    return file.with_name(f"{file.name}.part")


@contextmanager
def _explained(source: Source, url: str, file: Path) -> Iterator[None]:
    """Replace errors of the connection and of the checksum by errors with a remedy."""
    pooch.get_logger().setLevel("WARNING")
    try:
        yield
    except requests.HTTPError as error:
        response = error.response
        assert response is not None  # that of the server, whose status is the error
        if response.status_code == requests.codes.requested_range_not_satisfiable:
            _partial_file(file).unlink()
            raise DownloadError(f"{url}: the file has changed. Start again.") from None
        raise DownloadError(
            f"{url}: the server answers {response.status_code} {response.reason}. If the address "
            f"is out of date, see {source.page}"
        ) from None
    except requests.RequestException as error:
        size = _partial_file(file).stat().st_size
        raise BrokenConnectionError(
            f"{url}: the connection failed after {size} bytes ({type(error).__name__}). Start "
            f"again to continue from there. If the address is out of date, see {source.page}"
        ) from None
    except ValueError:  # of Pooch
        raise DownloadError(
            f"{url}: the file has another checksum than expected. It was removed; start again. If "
            f"the file has really changed, remove its line from {file.parent / CHECKSUMS}."
        ) from None
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(_partial_file(file))) from error


def _resume(
    url: str,
    output_file: str,
    pooch_: Any,
    *,
    partial_file: Path,
    on_progress: Callable[[int, int], None],
) -> None:
    """Append the rest to `partial_file` and move it to `output_file`; a downloader of Pooch."""
    with partial_file.open("ab") as file:
        start = file.tell()

        def start_over_without_range(response: Any, **_: Any) -> None:
            if start and response.status_code == requests.codes.ok:  # 206: the rest of the file
                file.truncate(0)
                bar.start = 0

        bar = _Bar(start, on_progress)
        headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={start}-"} if start else {})
        pooch.HTTPDownloader(
            progressbar=bar,
            chunk_size=_CHUNK,
            timeout=TIMEOUT,
            headers=headers,
            hooks={"response": start_over_without_range},
        )(url, file, pooch_)
    partial_file.replace(output_file)


class _Bar:
    """Progress bar with the methods that Pooch calls."""

    def __init__(self, start: int, on_progress: Callable[[int, int], None]) -> None:
        self.start, self.total, self._done, self._on_progress = start, 0, 0, on_progress

    def update(self, n_bytes: int) -> None:
        """Add received bytes."""
        self._done = min(self._done + n_bytes, self.total)
        self._on_progress(self.start + self._done, self.start + self.total)

    def reset(self) -> None:
        """Count from the start again."""
        self._done = 0

    def close(self) -> None:
        """Do nothing: the owner of the callback closes its bar."""


def _unpack(file: Path, folder: Path, url: str) -> None:
    """Unpack a ZIP file, which checks the CRC of each member; remove it if it is damaged."""
    try:
        with ZipFile(file) as archive:
            archive.extractall(folder)
    except (BadZipFile, EOFError, zlib.error) as error:
        file.unlink()
        raise DownloadError(
            f"{url}: the file is damaged or no ZIP file ({error}). It was removed; start again."
        ) from None


def _only_folder(folder: Path) -> Path:
    """Return the folder in which an archive has all of its files, or the folder itself."""
    entries = [entry for entry in folder.iterdir() if entry.name != "__MACOSX"]
    return entries[0] if len(entries) == 1 and entries[0].is_dir() else folder
