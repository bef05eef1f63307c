"""The SQLite file of an experiment: schema, connections, and digests of all rows.

Every row has a SHA-256 digest of its other columns. For every table, the file also stores the XOR
of the digests of all its rows. Readers thereby detect changed, missing and added rows.
"""

import hashlib
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any
from urllib.parse import quote

from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import DATABASE

APPLICATION_ID = 0x74726D6B
"""SQLite application id of trackmark's files: "trmk" in ASCII."""

SCHEMA_VERSION = 4
"""Version of the schema."""

_BUSY_SECONDS = 60.0

_TABLES = {
    "setting": ("name TEXT PRIMARY KEY, value TEXT NOT NULL", ""),  # title, digests of tables
    "requested": (
        "position INTEGER PRIMARY KEY, tracker TEXT NOT NULL, sequence TEXT NOT NULL, "
        "repetition INTEGER NOT NULL, protocol TEXT NOT NULL, version TEXT NOT NULL",
        "UNIQUE (tracker, sequence, repetition, protocol)",
    ),
    "tracker": ("version TEXT PRIMARY KEY, identity TEXT NOT NULL", ""),  # JSON of `Identity`
    "truth": (
        "sequence TEXT NOT NULL, fingerprint TEXT NOT NULL, data BLOB NOT NULL",
        "PRIMARY KEY (sequence, fingerprint)",
    ),
    "run": (
        "id INTEGER PRIMARY KEY, tracker TEXT NOT NULL, sequence TEXT NOT NULL, "
        "repetition INTEGER NOT NULL, protocol TEXT NOT NULL, "
        "version TEXT NOT NULL REFERENCES tracker, fingerprint TEXT NOT NULL, "
        "status TEXT NOT NULL CHECK (status IN ('finished', 'failed')), failure TEXT NOT NULL, "
        "output TEXT NOT NULL, frames INTEGER NOT NULL, seconds REAL, frame_seconds REAL, "
        "circumstances TEXT NOT NULL, contents TEXT NOT NULL",
        "UNIQUE (tracker, sequence, repetition, protocol)",
    ),
    "content": (  # `frames`, `revised`, `arrays`; not in `run`, so that runs are listed quickly
        "run INTEGER NOT NULL REFERENCES run, name TEXT NOT NULL, data BLOB NOT NULL",
        "PRIMARY KEY (run, name)",
    ),
    "score": (
        "run INTEGER PRIMARY KEY REFERENCES run, scorer TEXT NOT NULL, scores TEXT NOT NULL",
        "",
    ),
}


_STATEMENTS = [
    f"CREATE TABLE {name} ("
    + ", ".join(filter(None, [columns, "sha256 BLOB NOT NULL", constraint]))
    + ") STRICT"
    for name, (columns, constraint) in _TABLES.items()
]


class DamagedError(ResultsError):
    """Damaged file: its content is not what was written. The message names the file."""


def digest(values: Iterable[Any]) -> bytes:
    """Return the SHA-256 digest of values (texts, numbers, None or bytes) and of their types."""
    # Bytes are replaced by their digest, so that `repr` stays short.
    values = [hashlib.sha256(v).digest() if isinstance(v, bytes) else v for v in values]
    return hashlib.sha256(repr(values).encode("utf-8", "backslashreplace")).digest()


def is_intact(row: sqlite3.Row) -> bool:
    """Return whether a row matches the digest in its last column."""
    *columns, sha256 = row
    return bool(digest(columns) == sha256)


class Database:
    """The tables of one experiment within one transaction; see `open_database`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection
        self._changed: Counter[str] = Counter()  # exclusive or of changed rows' digests

    def select(self, query: str, *values: Any) -> list[Any]:
        """Return the rows of a query without checking digests."""
        return self._connection.execute(query, values).fetchall()

    def rows(self, table: str, where: str = "1", *values: Any) -> list[sqlite3.Row]:
        """Return rows of a table, each with its digest as the last column.

        Raises `DamagedError` if a row was changed.
        """
        rows = self.select(f"SELECT * FROM {table} WHERE {where}", *values)
        for row in rows:
            if not is_intact(row):
                raise self.changed_row(table, row)
        return rows

    def intact_rows(self, table: str) -> tuple[list[sqlite3.Row], list[DamagedError]]:
        """Return all unchanged rows, and an error for each changed row.

        Raises `DamagedError` if rows are missing.
        """
        rows = self.select(f"SELECT * FROM {table}")
        stored = [row["sha256"] for row in rows]
        computed = [digest([*row][:-1]) for row in rows]
        # In a changed row, either the digest or the other columns are still the original ones.
        if int(self.setting(_total(table)), 16) not in (_combine(stored), _combine(computed)):
            raise self.damaged(f"rows of its table {table!r} are missing")
        if stored == computed:
            return rows, []
        changed = [self.changed_row(table, row) for row in rows if not is_intact(row)]
        return [row for row in rows if is_intact(row)], changed

    def table(self, name: str) -> list[sqlite3.Row]:
        """Return all rows of a table; raise `DamagedError` if any is changed or missing."""
        rows, errors = self.intact_rows(name)
        if errors:
            raise errors[0]
        return rows

    def setting(self, name: str) -> str:
        """Return the value stored by `set`; raise `DamagedError` if it is missing."""
        for row in self.rows("setting", "name = ?", name):
            return str(row["value"])
        raise self.damaged(f"the setting {name!r} is missing")

    def set(self, name: str, value: str) -> None:
        """Store a value under a name."""
        values = name, value, digest((name, value))
        self._connection.execute("INSERT OR REPLACE INTO setting VALUES (?, ?, ?)", values)

    def insert(self, table: str, rows: Iterable[Sequence[Any]]) -> None:
        """Insert rows, given the values of all columns except the digest."""
        sealed = [(*row, digest(row)) for row in rows]
        if sealed:
            marks = ", ".join("?" * len(sealed[0]))
            self._connection.executemany(f"INSERT INTO {table} VALUES ({marks})", sealed)
            self._changed[table] ^= _combine(row[-1] for row in sealed)

    def repair(self, table: str, row: Sequence[Any]) -> None:
        """Replace a damaged row by its original values."""
        marks = ", ".join("?" * (len(row) + 1))
        query = f"INSERT OR REPLACE INTO {table} VALUES ({marks})"
        self._connection.execute(query, (*row, digest(row)))
        self.recount(table)

    def delete(self, table: str, where: str = "1", *values: Any) -> None:
        """Delete rows."""
        removed = self.select(f"SELECT sha256 FROM {table} WHERE {where}", *values)
        if removed:
            self._connection.execute(f"DELETE FROM {table} WHERE {where}", values)
            self._changed[table] ^= _combine(row["sha256"] for row in removed)

    def recount(self, *tables: str) -> None:
        """Recompute the digests of tables (default: all), after damaged rows were deleted."""
        for table in tables or _TABLES.keys() - {"setting"}:
            rows = self.select(f"SELECT sha256 FROM {table}")
            self.set(_total(table), f"{_combine(row['sha256'] for row in rows):x}")
            del self._changed[table]

    def store_totals(self) -> None:
        """Store the digests of the tables that were changed."""
        for table, change in self._changed.items():
            self.set(_total(table), f"{int(self.setting(_total(table)), 16) ^ change:x}")

    def rebuild_indexes(self) -> None:
        """Rebuild all indexes from their tables; raise `DamagedError` if other damage remains."""
        self._connection.execute("REINDEX")
        if problem := self._structural_damage():
            raise self.damaged(problem)

    def _structural_damage(self) -> str:
        """Return the first damage of the file's structure in one line; empty if there is none."""
        first = str(self.select("PRAGMA integrity_check(1)")[0][0])
        return "" if first == "ok" else first.replace("\n", " ")

    def find_damage(self) -> list[str]:
        """Return a message for each damage of the file's structure, and for each damaged table."""
        messages = []
        if problem := self._structural_damage():
            messages.append(str(self.damaged(problem)))
        for table in _TABLES:
            try:
                if table == "setting":
                    self.rows(table)
                    self.setting("title")
                else:
                    self.table(table)
            except DamagedError as error:
                messages.append(str(error))
            except (sqlite3.Error, UnicodeDecodeError) as error:
                messages.append(str(_to_results_error(self.path, error)))
        return messages

    def changed_row(self, table: str, row: sqlite3.Row) -> DamagedError:
        """Return the error for a changed row."""
        values = ", ".join(str(value)[:60] for value in tuple(row)[:5] if value != "")
        return self.damaged(f"a row of its table {table!r} was changed ({values})")

    def damaged(self, reason: str) -> DamagedError:
        """Return the error for damage of the file."""
        return DamagedError(
            f"{self.path} is damaged: {reason}. Restore the file from a backup, or remove the "
            "damaged runs (`trackmark results remove`) and run the same command again."
        )

    def copy(self, target: Path) -> None:
        """Copy the file to a folder that contains no results."""
        with closing(sqlite3.connect(target / DATABASE)) as copy:
            self._connection.backup(copy)

    def create(self) -> None:
        """Create empty tables."""
        for statement in _STATEMENTS:
            self._connection.execute(statement)
        self._connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        self._connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        self.set("title", "")
        self.recount()


@contextmanager
def open_database(folder: Path, *, write: bool = False) -> Iterator[Database]:
    """Open the file of an experiment for one transaction.

    `folder` is the experiment's folder. If it has no results, writing creates them, and reading
    returns empty tables. `write` locks the file for other writers. An exception undoes all changes.

    Raises `ResultsError`, which names the file, if it is damaged, has another version, or cannot be
    read or written.
    """
    path = folder / DATABASE
    connection = None
    try:
        connection = _open(path, write=write)
        database = _validated_database(path, connection)
        if database is None:  # the file is new or empty
            if not write:
                connection.close()
                connection = _in_memory()
            database = Database(path, connection)
            database.create()
        yield database
        if write:
            database.store_totals()
        connection.execute("COMMIT")
    except (sqlite3.Error, UnicodeDecodeError) as error:  # in a message of SQLite
        raise _to_results_error(path, error) from error
    finally:
        if connection is not None:
            connection.close()


def _open(path: Path, *, write: bool) -> sqlite3.Connection:
    """Open the file and begin a transaction."""
    if not path.exists():
        if not write:
            return _in_memory()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(
                f"{path} cannot be written: {error.strerror}. Choose another folder with --output."
            ) from error
    # `rw` also opens write-protected files for reading. `immutable=1` must not be used: it ignores
    # the journal of an interrupted transaction and returns half of its changes.
    mode = "rwc" if write else "rw"
    connection = sqlite3.connect(
        f"file:{quote(str(path.absolute()))}?mode={mode}",
        uri=True,
        timeout=_BUSY_SECONDS,
        isolation_level=None,
    )
    connection.row_factory = sqlite3.Row
    connection.execute("PRAGMA foreign_keys = ON")
    # EXTRA also syncs the folder after the journal is deleted. Otherwise, the journal could
    # reappear after a power cut and undo a completed transaction. The journal mode is DELETE,
    # because WAL fails on network file systems and requires write access for reading.
    connection.execute("PRAGMA synchronous = EXTRA")
    # IMMEDIATE waits for other writers before the first read. Otherwise, two transactions that have
    # both read could wait for each other, and SQLite would abort one of them.
    connection.execute("BEGIN IMMEDIATE" if write else "BEGIN")
    return connection


def _in_memory() -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    connection.row_factory = sqlite3.Row
    connection.execute("BEGIN")
    return connection


def _validated_database(path: Path, connection: sqlite3.Connection) -> Database | None:
    """Return the database, or None if the file is empty; raise `ResultsError` if it is foreign."""
    application = connection.execute("PRAGMA application_id").fetchone()[0]
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    tables = connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0]
    if not (application or version or tables or (path.exists() and path.stat().st_size)):
        return None
    if application != APPLICATION_ID:
        raise DamagedError(
            f"{path} is damaged or not a file of trackmark: its application id is "
            f"{application:#x}, expected {APPLICATION_ID:#x}. Move the file elsewhere, or restore "
            "it from a backup."
        )
    if version != SCHEMA_VERSION:
        raise ResultsError(
            f"{path} has the schema version {version}; this version of trackmark reads "
            f"{SCHEMA_VERSION}. Read it with the version of trackmark that wrote it, or store new "
            "runs in another folder."
        )
    database = Database(path, connection)
    stored = connection.execute("SELECT sql FROM sqlite_schema WHERE type = 'table'").fetchall()
    if not {row[0] for row in stored} >= set(_STATEMENTS):  # earlier versions had further tables
        raise database.damaged("its tables do not have the expected columns")
    return database


def _total(table: str) -> str:
    return f"digest of {table}"


def _combine(digests: Iterable[bytes]) -> int:
    # In a damaged file, a digest can be null or text.
    valid = (sha256 for sha256 in digests if isinstance(sha256, bytes))
    return reduce(xor, (int.from_bytes(sha256, "big") for sha256 in valid), 0)


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
    remedies = (text for prefix, text in _REMEDIES.items() if name.startswith(prefix))
    remedy = next(remedies, "Run the same command again.")
    return ResultsError(f"{path} cannot be read or written: {error}. {remedy}")


_PERMISSIONS = "Correct the permissions, or choose another folder with --output."
_REMEDIES = {
    "SQLITE_FULL": "Free disk space, or choose another folder with --output.",
    "SQLITE_READONLY": _PERMISSIONS,
    "SQLITE_CANTOPEN": _PERMISSIONS,
    "SQLITE_PERM": _PERMISSIONS,
    "SQLITE_AUTH": _PERMISSIONS,
    "SQLITE_IOERR_NOMEM": "Free some memory, and run the same command again.",
    "SQLITE_IOERR": "Free disk space, check the disk, or choose another folder with --output.",
    "SQLITE_NOMEM": "Free some memory, and run the same command again.",
    "SQLITE_PROTOCOL": (
        "The file system does not lock files reliably. Run the same command again, or choose a "
        "folder on a local disk with --output."
    ),
    "SQLITE_NOLFS": "Choose a folder on another file system with --output.",
}
"""Remedies by start of the name of SQLite's error; the longer of two starts comes first."""
