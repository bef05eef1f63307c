"""The SQLite file of an experiment: folders, keys, schema, packed arrays, one digest per row.

The file `runs.db` in the folder of an experiment holds requested and stored runs, ground truths and
scores. Reports and other files of commands lie in the same folder; the store reads none of them.

Each row has a SHA-256 digest of its other columns. The row of a run holds everything that belongs
to the run, also its arrays, so that readers notice each change of a run. A row that does not match
its digest counts as missing: readers skip it and name it, and the next `trackmark run` repeats the
run. A deleted row is missing in the same way.
"""

import hashlib
import json
import logging
import sqlite3
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.spec_string import close_match


class ResultsError(ValueError):
    """Error in reading or writing results; the message names the folder or file."""


class DamagedError(ResultsError):
    """Error for content that is not what was written, or is missing; the message names the file."""


FILE_NAME = "runs.db"
"""Name of the file that holds the results of an experiment."""

RunKey: TypeAlias = tuple[str, str, int, str]
"""Key of a run: tracker (label), sequence, repetition, protocol."""

RUN_KEY_COLUMNS = ("tracker", "sequence", "repetition", "protocol")
"""Names of the fields of a `RunKey` in rows and data frames."""


def run_key(row: Any) -> RunKey:
    """Return the key of a run from its row, or from its `Identity`."""
    fields = row if hasattr(row, "keys") else vars(row)  # `sqlite3.Row` is not a `Mapping`
    return fields["tracker"], fields["sequence"], int(fields["repetition"]), fields["protocol"]


def refuse_empty_file(folder: Path) -> None:
    """Raise `DamagedError` for a results file of zero bytes, which trackmark never leaves."""
    file = folder / FILE_NAME
    if file.is_file() and not file.stat().st_size:
        raise DamagedError(
            f"{file} is damaged: it has 0 bytes. Restore the file from a backup, or remove it and "
            "run the same command again."
        )


def experiment_folders(folder: Path, *, damaged: bool = False) -> list[Path]:
    """Return the experiments' folders: the folder itself, and its subfolders with results.

    `damaged`: also return folders with an empty file.

    Raises `ResultsError` if there are none, or if one has an empty file.
    """
    candidates = [folder, *sorted(folder.glob("*/"))] if folder.is_dir() else []
    folders = [path for path in candidates if (path / FILE_NAME).is_file()]
    for path in folders if not damaged else ():
        refuse_empty_file(path)
    if not folders:
        raise no_results(folder)
    return folders


def no_results(folder: Path) -> ResultsError:
    """Return the error for a folder without results; it names a folder of a similar name."""
    others = [file.parent.name for file in folder.parent.glob(f"*/{FILE_NAME}")]
    return ResultsError(
        f"{folder}: this folder contains no results.{close_match(folder.name, others)} "
        "`trackmark run` creates results."
    )


def single_experiment(folder: Path) -> Path:
    """Return the folder of the only experiment in a folder, which may be the folder itself.

    Raises `ResultsError` if there is none, or if there are several.
    """
    experiments = experiment_folders(folder)
    if len(experiments) > 1:
        names = ", ".join(map(str, experiments))
        raise ResultsError(f"{folder} contains several experiments. Choose one of {names}.")
    return experiments[0]


APPLICATION_ID = 0x74726D6B
"""SQLite application id of trackmark's files: "trmk" in ASCII."""

SCHEMA_VERSION = 5
"""Version of the schema."""

_BUSY_SECONDS = 60.0

_TABLES = {
    # `requests`: JSON of the requested runs. One row, so that none of them can get lost unnoticed.
    "metadata_of_file": ("name TEXT PRIMARY KEY, value TEXT NOT NULL", ""),
    "truth": (
        "sequence TEXT NOT NULL, fingerprint TEXT NOT NULL, arrays BLOB NOT NULL",
        "PRIMARY KEY (sequence, fingerprint)",
    ),
    "run": (
        "id INTEGER PRIMARY KEY, tracker TEXT NOT NULL, sequence TEXT NOT NULL, "
        "repetition INTEGER NOT NULL, protocol TEXT NOT NULL, "
        "version TEXT NOT NULL, fingerprint TEXT NOT NULL, "
        "status TEXT NOT NULL CHECK (status IN ('finished', 'failed')), failure TEXT NOT NULL, "
        "tracker_output TEXT NOT NULL, frames INTEGER NOT NULL, seconds REAL, "
        "reading_seconds REAL, identity TEXT NOT NULL, metadata TEXT NOT NULL, "
        "arrays BLOB NOT NULL",
        "UNIQUE (tracker, sequence, repetition, protocol)",
    ),
    # Scores can be computed again, after a change of their code also in another order than runs.
    "score": (
        "run INTEGER PRIMARY KEY REFERENCES run ON DELETE CASCADE, scorer TEXT NOT NULL, "
        "scores TEXT NOT NULL",
        "",
    ),
}

_TABLE_STATEMENTS = [
    f"CREATE TABLE {name} ("
    + ", ".join(filter(None, [columns, "sha256 BLOB NOT NULL", constraint]))
    + ") STRICT"
    for name, (columns, constraint) in _TABLES.items()
]
_CREATE = [
    *_TABLE_STATEMENTS,
    f"PRAGMA application_id = {APPLICATION_ID}",
    f"PRAGMA user_version = {SCHEMA_VERSION}",
]


@cache
def warn_of_damage(message: str) -> None:
    """Log a warning, once per process; by default on standard error."""
    logging.getLogger("trackmark").warning(message)


def _digest(values: Iterable[Any]) -> bytes:
    """Return the SHA-256 digest of values (texts, numbers, None or bytes) and of their types."""
    # Bytes are replaced by their digest, so that `repr` stays short.
    values = [hashlib.sha256(v).digest() if isinstance(v, bytes) else v for v in values]
    return hashlib.sha256(repr(values).encode("utf-8", "backslashreplace")).digest()


class Database:
    """The tables of one experiment within one transaction; see `open_database`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    def select(self, query: str, *values: Any) -> list[Any]:
        """Return the rows of a query without checking digests."""
        return self._connection.execute(query, values).fetchall()

    def rows(
        self,
        table: str,
        where: str = "1",
        *values: Any,
        on_damage: Callable[[str], object] | None = None,
    ) -> Iterator[sqlite3.Row]:
        """Yield the undamaged rows of a table, each with its digest as the last column.

        `on_damage` is called with a message on each damaged row. Without it, the first damaged row
        raises `DamagedError`.
        """
        # One by one: all rows of `run` together can be larger than the memory.
        for row in self._connection.execute(f"SELECT * FROM {table} WHERE {where}", values):
            *columns, sha256 = row
            if _digest(columns) == sha256:
                yield row
            else:
                named = ", ".join(str(value)[:60] for value in tuple(row)[:5] if value != "")
                error = self.damaged(f"a row of its table {table!r} was changed ({named})")
                if on_damage is None:
                    raise error
                on_damage(str(error))

    def insert(self, table: str, rows: Iterable[Sequence[Any]]) -> None:
        """Insert rows, given the values of all columns except the digest.

        A row with the same primary key is replaced.
        """
        sealed = [(*row, _digest(row)) for row in rows]
        if sealed:
            marks = ", ".join("?" * len(sealed[0]))
            self._connection.executemany(f"INSERT OR REPLACE INTO {table} VALUES ({marks})", sealed)

    def delete(self, table: str, where: str = "1", *values: Any) -> None:
        """Delete rows."""
        self._connection.execute(f"DELETE FROM {table} WHERE {where}", values)

    def find_damage(self) -> list[str]:
        """Return messages on the first damage of the file's structure and on each damaged row."""
        first = str(self.select("PRAGMA integrity_check(1)")[0][0])
        messages = [] if first == "ok" else [str(self.damaged(first.replace("\n", " ")))]
        for table in _TABLES:
            try:
                for _ in self.rows(table, on_damage=messages.append):
                    pass
            except (sqlite3.Error, UnicodeDecodeError) as error:
                messages.append(str(_to_results_error(self.path, error)))
        return messages

    def damaged(self, reason: str) -> DamagedError:
        """Return the error for damage of the file."""
        return DamagedError(
            f"{self.path} is damaged: {reason}. Restore the file from a backup, remove the damaged "
            "runs (`trackmark results remove`) and run the same command again, or copy the "
            "undamaged ones to another folder (`trackmark results merge`)."
        )


@contextmanager
def open_database(folder: Path, *, for_writing: bool = False) -> Iterator[Database]:
    """Open the file of an experiment for one transaction.

    `folder` is the experiment's folder. If it has no results, writing creates them, and reading
    returns empty tables. `for_writing` locks the file for other writers. An exception undoes all
    changes.

    Raises `ResultsError`, which names the file, if it is damaged, has another version, or cannot be
    read or written.
    """
    path = folder / FILE_NAME
    try:
        with closing(_open(path, for_writing=for_writing)) as connection:
            # IMMEDIATE waits for other writers before the first read. Otherwise, two transactions
            # that have both read could wait for each other, and SQLite would abort one of them.
            connection.execute("BEGIN IMMEDIATE" if for_writing else "BEGIN")
            database = Database(path, connection)
            _validate(database)
            yield database
            connection.execute("COMMIT")
    except (sqlite3.Error, UnicodeDecodeError) as error:  # in a message of SQLite
        raise _to_results_error(path, error) from error


def _open(path: Path, *, for_writing: bool) -> sqlite3.Connection:
    """Open the file; reading a missing or new file opens an empty database in memory."""
    if for_writing:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(
                f"{path} cannot be written: {error.strerror}. "
                "Choose another folder with --results-root."
            ) from error
    # `rw` also opens write-protected files for reading. `immutable=1` must not be used: it ignores
    # the journal of an interrupted transaction and returns half of its changes.
    uri = f"file:{quote(str(path.absolute()))}?mode={'rwc' if for_writing else 'rw'}"
    if not for_writing and not (path.exists() and path.stat().st_size):
        uri = ":memory:"
    connection = sqlite3.connect(uri, uri=True, timeout=_BUSY_SECONDS, isolation_level=None)
    connection.row_factory = sqlite3.Row
    # A text that is not UTF-8 costs only its row, which then differs from its digest.
    connection.text_factory = lambda encoded: encoded.decode("utf-8", "backslashreplace")
    connection.execute("PRAGMA foreign_keys = ON")
    # EXTRA also syncs the folder after the journal is deleted. Otherwise, the journal could
    # reappear after a power cut and undo a completed transaction. The journal mode is DELETE,
    # because WAL fails on network file systems and requires write access for reading.
    connection.execute("PRAGMA synchronous = EXTRA")
    return connection


def _validate(database: Database) -> None:
    """Create the tables of a new file; raise `ResultsError` for a file that is not trackmark's."""
    file = database.select("PRAGMA database_list")[0]["file"]  # empty in memory
    if not (file and Path(file).stat().st_size):
        for statement in _CREATE:
            database.select(statement)
        return
    ((application,),) = database.select("PRAGMA application_id")
    ((version,),) = database.select("PRAGMA user_version")
    tables = {row[0] for row in database.select("SELECT sql FROM sqlite_schema")}
    if application != APPLICATION_ID:
        raise DamagedError(
            f"{database.path} is damaged or not a file of trackmark: its application id is "
            f"{application:#x}, expected {APPLICATION_ID:#x}. Move the file elsewhere, or restore "
            "it from a backup."
        )
    if version != SCHEMA_VERSION:
        raise ResultsError(
            f"{database.path} has the schema version {version}; this version of trackmark reads "
            f"{SCHEMA_VERSION}. Read it with the version of trackmark that wrote it, or store new "
            "runs in another folder."
        )
    if not tables >= set(_TABLE_STATEMENTS):
        raise database.damaged("its tables do not have the expected columns")


def _to_results_error(path: Path, error: Exception) -> ResultsError:
    """Return the `ResultsError` for an error of SQLite; only some errors mean damage."""
    name = getattr(error, "sqlite_errorname", "")
    if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
        return ResultsError(
            f"{path}: another process has locked this file for {_BUSY_SECONDS:.0f} s. End that "
            "process, and run the same command again."
        )
    if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")) or not name:
        return DamagedError(
            f"{path} is damaged: {error}. Restore the file from a backup, or remove it and run the "
            "same command again."
        )
    remedies = (remedy for start, remedy in _REMEDIES.items() if name.startswith(start))
    remedy = next(remedies, "Run the same command again.")
    return ResultsError(f"{path} cannot be read or written: {error}. {remedy}")


_MEMORY = "Free some memory, and run the same command again."
_PERMISSIONS = "Correct the permissions, or choose another folder with --results-root."
# By the start of the name of SQLite's error; the longer of two starts comes first.
_REMEDIES = {
    "SQLITE_FULL": "Free disk space, or choose another folder with --results-root.",
    "SQLITE_READONLY": _PERMISSIONS,
    "SQLITE_CANTOPEN": _PERMISSIONS,
    "SQLITE_PERM": _PERMISSIONS,
    "SQLITE_AUTH": _PERMISSIONS,
    "SQLITE_IOERR_NOMEM": _MEMORY,
    "SQLITE_NOMEM": _MEMORY,
    "SQLITE_IOERR": (
        "Free disk space, check the disk, or choose another folder with --results-root."
    ),
    "SQLITE_PROTOCOL": (
        "The file system does not lock files reliably. Run the same command again, or choose a "
        "folder on a local disk with --results-root."
    ),
    "SQLITE_NOLFS": "Choose a folder on another file system with --results-root.",
}

_HEADER = 4  # number of bytes that encode the size of the header of packed arrays


def pack(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return named arrays as bytes: a header and the arrays' bytes, compressed together.

    The first bytes of all elements come first, then all second bytes, and so on. This order
    compresses better, because neighbouring values differ in few bytes.
    """
    header: list[tuple[str, str, tuple[int, ...]]] = []
    chunks = []
    for name, values in arrays.items():
        header.append((name, values.dtype.str, values.shape))
        flat = np.ascontiguousarray(values).reshape(-1)
        chunks.append(flat.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes())
    encoded_header = json.dumps(header).encode()
    size = len(encoded_header).to_bytes(_HEADER, "little")
    return zlib.compress(size + encoded_header + b"".join(chunks))


def unpack(packed: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays, read-only, from the bytes that `pack` returned."""
    raw = zlib.decompress(packed)
    offset = _HEADER + int.from_bytes(raw[:_HEADER], "little")
    arrays = {}
    for name, type_name, shape in json.loads(raw[_HEADER:offset]):
        dtype = np.dtype(type_name)
        size = int(np.prod(shape)) * dtype.itemsize
        flat = np.frombuffer(raw, np.uint8, size, offset).reshape(dtype.itemsize, -1).T
        arrays[name] = np.ascontiguousarray(flat).reshape(-1).view(dtype).reshape(shape)
        arrays[name].flags.writeable = False  # several readers can share a run
        offset += size
    return arrays


def select_group(arrays: Mapping[str, NDArray[Any]], group: str) -> dict[str, NDArray[Any]]:
    """Return the arrays whose names start with `group/`, by their names without this prefix."""
    return {k.partition("/")[2]: a for k, a in arrays.items() if k.startswith(f"{group}/")}
