"""Others' results as runs: in a folder of their own, or beside those of an experiment for a while.

Boxes are scored by the truth of the sequences that are named. Their first is the truth's; by it,
too, is seen whether a file counts pixels from 0 or from 1. Times are not taken: they are of other
machines.
"""

import hashlib
import re
import shutil
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

import datasets
from bench.evaluation.record import Run
from bench.exchange import layout, names, sniffed
from bench.exchange.layout import ExchangeError, Layout, Said
from bench.experiments.contestant import Identity
from bench.experiments.experiment import SequenceSource
from bench.protocols import STORED_ONCE
from bench.store.asked import Asked
from bench.store.index import index_rows, read_table
from bench.store.layout import Cell
from bench.store.results import Results
from bench.store.truth import read_truth, write_truth

__all__ = ["Guest", "On", "guest", "import_results", "on_sequences", "with_guests"]

_ORIGINS = (0, 1)
_SAME = 0.3  # pixels: trackers that scale images begin beside the truth; origins are 1 apart


@dataclass(frozen=True)
class Guest:
    """A tracker whose results are others'."""

    tracker: str  # its label in tables
    layout: str
    folder: Path


@dataclass(frozen=True)
class On:
    """A sequence that results are of: its truth, and where it was opened from."""

    name: str
    fingerprint: str
    boxes: NDArray[np.float64]
    source: str
    truth: str = ""


def guest(text: str) -> Guest:
    """A tracker of `NAME=PATH` or `NAME=LAYOUT:PATH`.

    Raises `ExchangeError` for a text of another form, and where no layout fits.
    """
    tracker, equals, path = (part.strip() for part in text.partition("="))
    if not (tracker and equals and path):
        raise ExchangeError(f"{text!r} is not NAME=PATH, a tracker's name and its folder.")
    kind, colon, rest = path.partition(":")
    if colon and kind in names():
        if not Path(rest).is_dir():
            raise ExchangeError(f"{rest} is no folder with a tracker's results.")
        return Guest(tracker, kind, Path(rest))
    return Guest(tracker, sniffed(Path(path)), Path(path))


def on_sequences(sources: Sequence[SequenceSource], folder: Path) -> list[On]:
    """Sequences that are opened for it; their truth is kept in an experiment's folder.

    Raises `SequenceError` for one that can't be opened, or has no truth.
    """
    found = []
    for source in sources:
        sequence = datasets.load(source.text, truth=source.truth)
        sequence.check_runnable()
        write_truth(folder, sequence)
        place = source.absolute()
        key = sequence.name, sequence.fingerprint, sequence.boxes
        found.append(On(*key, place.text, str(place.truth or "")))
    return found


def import_results(
    guests: Sequence[Guest], on: Sequence[On], folder: Path, tell: Callable[[str], None]
) -> int:
    """Keep results as runs in an experiment's folder, in which the truths lie; give their number.

    `tell` is given a sentence on what of a tracker's files is not taken. Raises `ExchangeError` for
    a sequence without results, and files that are malformed or too short or long.
    """
    results = Results(folder)
    runs = [run for one in guests for run in _by_protocol(list(_runs(one, on, tell)))]
    keys = [run.identity for run in runs]
    cells: dict[Cell, str] = {
        (key.tracker, key.sequence, key.repetition, key.protocol): key.version for key in keys
    }
    results.prepare(Asked("", cells))
    for run in runs:
        path = results.path(run.identity)
        there = results.read(path).identity if path.exists() else None
        if there is not None and there.tracker_version.get("source") != _SOURCE:
            raise ExchangeError(f"{folder} has runs of {there.tracker} already: name it otherwise.")
        results.write(run, there.version if there else "")
    return len(runs)


@contextmanager
def with_guests(
    experiment: Path,
    guests: Sequence[Guest],
    tell: Callable[[str], None],
    sequences: Collection[str] | None = None,
) -> Iterator[Path]:
    """An experiment's folder with others' results in it, for as long as it is looked at.

    It links to the runs there, which stay as they are. `sequences`: those of the experiment that
    are meant, all by default. Raises as `import_results`.
    """
    index = read_table(Results(experiment))
    taken = set(index["tracker"].unique().to_pylist())
    if both := taken & {one.tracker for one in guests}:
        raise ExchangeError(f"{experiment} has runs of {min(both)} already: name it otherwise.")
    rows = {row["sequence"]: row for row in index_rows(index)}.values()
    with TemporaryDirectory(prefix="trackmark-") as made:
        folder = Path(made) / experiment.resolve().name
        folder.mkdir()
        for path in experiment.resolve().iterdir():
            if path.is_dir() and (path.name[0] not in "_." or path.name == "_truth"):
                (folder / path.name).symlink_to(path, target_is_directory=True)
            elif path.name in ("plan.json", "index.arrow"):
                shutil.copyfile(path, folder / path.name)
        on = [
            On(
                row["sequence"],
                row["fingerprint"],
                read_truth(experiment, row["sequence"], row["fingerprint"]).boxes,
                row["source"],
                row["truth"],
            )
            for row in rows
            if sequences is None or row["sequence"] in sequences
        ]
        import_results(guests, on, folder, tell)
        yield folder


_SOURCE = "results of others"
_BEGUN_AGAIN = "supervised"  # the protocol of runs that say so


def _by_protocol(runs: list[Run]) -> list[Run]:
    """A tracker's runs, which were begun again after failures where one of them was."""
    if all(run.states is None for run in runs):
        return runs
    return [replace(run, identity=replace(run.identity, protocol=_BEGUN_AGAIN)) for run in runs]


def _runs(one: Guest, on: Sequence[On], tell: Callable[[str], None]) -> Iterator[Run]:
    """Runs of a tracker on all of the sequences."""
    kind = layout(one.layout)
    there = kind.files(one.folder)
    by_letters: dict[str, list[str]] = {}
    for name in there:
        by_letters.setdefault(_letters(name), []).append(name)
    used = set()
    for sequence in on:
        alike = by_letters.get(_letters(sequence.name), [])
        name = sequence.name if sequence.name in there else alike[0] if len(alike) == 1 else ""
        if not name:
            raise ExchangeError(
                f"{one.folder}: there are no results on {sequence.name}. Looked for "
                f"{kind.expects}; there are {_some(sorted(there))}."
            )
        used.add(name)
        yield from _runs_on(one, kind, sequence, there[name], tell)
    if left := sorted(set(there) - used):
        tell(f"{one.folder}: not taken, as their sequences are not asked for: {_some(left)}.")


def _runs_on(
    one: Guest, kind: Layout, on: On, files: Sequence[Path], tell: Callable[[str], None]
) -> Iterator[Run]:
    content = hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()[:16]
    version = {"source": _SOURCE, "layout": one.layout, "files": content}
    for repetition, file in enumerate(files):
        said = kind.read(file)
        boxes = _boxes(kind, said, on, file, tell)
        if said.remark:
            tell(f"{file}: {said.remark}.")
        n = len(boxes)
        key = Identity(
            one.tracker,
            one.tracker,
            "",
            {},
            version,
            on.name,
            on.fingerprint,
            repetition,
            STORED_ONCE,
        )
        yield Run(
            key,
            boxes,
            np.asarray(np.isfinite(boxes).all(axis=1)),
            np.full(n, np.nan) if said.confidence is None else said.confidence,
            states=said.states,
            circumstances={"source": on.source, "truth": on.truth, "file": str(file.resolve())},
        )


def _boxes(
    kind: Layout, said: Said, on: On, file: Path, tell: Callable[[str], None]
) -> NDArray[np.float64]:
    """Boxes in our numbers, from the truth's first on."""
    n, m = len(said.boxes), len(on.boxes)
    if n != m:
        row = kind.row
        where = f"ends after {row} {n}" if n < m else f"{row} {m + 1} is one too many"
        raise ExchangeError(f"{file}: {n} rows for the {m} frames of {on.name}: {where}.")
    first = int(np.isfinite(on.boxes).all(axis=1).argmax())
    given, boxes = on.boxes[first], said.boxes.copy()
    shown = [
        origin
        for origin in _ORIGINS
        if np.abs(kind.held(given + [origin, origin, 0, 0]) - boxes[first])[:2].max() < _SAME
    ]
    if not shown and np.isfinite(boxes[first]).all():
        tell(
            f"{file}: its first box is not the truth's; pixels are taken to count from "
            f"{kind.origin}."
        )
    boxes[:, :2] -= shown[0] if shown else kind.origin
    boxes[:first], boxes[first] = np.nan, given
    return boxes


def _letters(name: str) -> str:
    """A name without what toolkits write differently: `Jogging.1`, `jogging-1`."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _some(found: Collection[str]) -> str:
    shown = ", ".join(list(found)[:3]) or "none"
    return f"{shown} and {len(found) - 3} more" if len(found) > 3 else shown
