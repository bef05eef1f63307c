"""Import of other toolkits' results as runs: in a folder of their own, or next to an experiment's.

Boxes are scored by the ground truth of the named sequences. The first box is replaced by the ground
truth; it also shows whether a file counts pixels from 0 or from 1. Times are not imported: they
come from other machines.
"""

import hashlib
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackmark import datasets
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.exchange import layout, names, sniffed
from trackmark.bench.exchange.first_boxes import FirstBox, check_first_boxes, origin_of
from trackmark.bench.exchange.result_format import ExchangeError, Layout, On, Said, letters, some
from trackmark.bench.experiments.experiment import SequenceSource
from trackmark.bench.experiments.tracker_spec import IMPORTED, Identity
from trackmark.bench.protocols import STORED_ONE_PASS, parse_protocol
from trackmark.bench.store.asked import Asked
from trackmark.bench.store.database import connected
from trackmark.bench.store.index import list_runs
from trackmark.bench.store.layout import Cell, cell_of
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import read_truth, write_truth


@dataclass(frozen=True)
class Guest:
    """Tracker whose results are imported."""

    tracker: str  # label in tables
    layout: str
    folder: Path


def guest(text: str) -> Guest:
    """Return the tracker of `NAME=PATH` or `NAME=LAYOUT:PATH`.

    Raises `ExchangeError` for a text of another form, and if no layout fits.
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
    """Open sequences, and write their ground truth into an experiment's folder.

    Raises `SequenceError` for one that cannot be opened, or has no ground truth.
    """
    opened = []
    for source in sources:
        sequence = datasets.load(source.text, truth=source.truth)
        sequence.check_runnable()
        write_truth(folder, sequence)
        place = source.absolute()
        key = sequence.name, sequence.fingerprint, sequence.boxes
        opened.append(On(*key, place.text, str(place.truth or "")))
    return opened


def import_results(
    guests: Sequence[Guest], on: Sequence[On], folder: Path, tell: Callable[[str], None]
) -> int:
    """Write results as runs into a folder that has the ground truths; return their number.

    `tell`: called with a sentence on files that are not imported. Raises `ExchangeError` for a
    sequence without results, and for files that are malformed, too short or too long.
    """
    results = Results(folder)
    runs = [run for one in guests for run in _by_protocol(list(_runs(one, on, tell)))]
    keys = [run.identity for run in runs]
    cells: dict[Cell, str] = {
        (key.tracker, key.sequence, key.repetition, key.protocol): key.version for key in keys
    }
    results.prepare(Asked("", cells))
    present = set(results.cells())
    for run in runs:
        cell = cell_of(run.identity)
        there = results.read(cell).identity if cell in present else None
        if there is not None and not there.imported:
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
    """Provide a temporary copy of an experiment's folder, with imported results in it.

    `sequences`: those of the experiment for which results
    are imported, all by default. Raises as `import_results`.
    """
    stored = list_runs(Results(experiment))
    taken = {row["tracker"] for row in stored}
    if both := taken & {one.tracker for one in guests}:
        raise ExchangeError(f"{experiment} has runs of {min(both)} already: name it otherwise.")
    rows = {row["sequence"]: row for row in stored}.values()
    with TemporaryDirectory(prefix="trackmark-") as made:
        folder = Path(made) / experiment.resolve().name
        folder.mkdir()
        with connected(experiment) as database:
            database.copy(folder)
        on = []
        for row in rows:
            if sequences is None or row["sequence"] in sequences:
                key = row["sequence"], row["fingerprint"]
                boxes = read_truth(experiment, *key).boxes
                on.append(On(*key, boxes, row["source"], row["truth"]))
        import_results(guests, on, folder, tell)
        yield folder


_STARTS_OF_TRE = 20
_BEGUN_AGAIN = "supervised"  # the protocol of runs that say so


def _by_protocol(runs: list[Run]) -> list[Run]:
    """Return a tracker's runs, all supervised if one of them was restarted after a failure."""
    if all(run.states is None for run in runs):
        return runs
    return [
        run if run.segments else replace(run, identity=replace(run.identity, protocol=_BEGUN_AGAIN))
        for run in runs
    ]


def _runs(one: Guest, on: Sequence[On], tell: Callable[[str], None]) -> Iterator[Run]:
    """Yield the runs of a tracker on all of the sequences."""
    kind = layout(one.layout)
    there = kind.files(one.folder)
    by_letters: dict[str, list[str]] = {}
    for name in there:
        by_letters.setdefault(letters(name), []).append(name)
    used = set()
    for sequence in on:
        alike = by_letters.get(letters(sequence.name), [])
        name = sequence.name if sequence.name in there else alike[0] if len(alike) == 1 else ""
        if not name:
            raise ExchangeError(
                f"{one.folder}: there are no results on {sequence.name}. Looked for "
                f"{kind.expects}; there are {some(sorted(there))}."
            )
        used.add(name)
        yield from _runs_on(one, kind, sequence, there[name], tell)
    if left := sorted(set(there) - used):
        tell(f"{one.folder}: not taken, as their sequences are not asked for: {some(left)}.")


def _runs_on(
    tracker: Guest, kind: Layout, on: On, files: Sequence[Path], tell: Callable[[str], None]
) -> Iterator[Run]:
    contents = [part.read_bytes() for file in files for part in kind.parts(file)]
    digest = hashlib.sha256(b"\0".join(contents)).hexdigest()[:16]
    version = {"source": IMPORTED, "layout": tracker.layout, "files": digest}
    for repetition, file in enumerate(files):
        content = kind.read(file)
        segments = _segments(kind, content, on, file)
        boxes = _boxes(kind, content, on, segments, file, tell)
        if content.remark:
            tell(f"{file}: {content.remark}.")
        protocol = _stored_protocol(content, segments, on, file, tell)
        name, sequence = tracker.tracker, (on.name, on.fingerprint)
        key = Identity(name, name, "", {}, version, *sequence, repetition, protocol)
        unknown = np.full(len(boxes), np.nan)
        run = Run(
            key,
            boxes,
            np.asarray(np.isfinite(boxes).all(axis=1)),
            unknown if content.confidence is None else content.confidence,
            states=content.states,
            segments=tuple(segments) if content.protocol else (),
            circumstances={"source": on.source, "truth": on.truth, "file": str(file.resolve())},
        )
        yield _padded(run, on)


def _segments(kind: Layout, content: Said, on: On, file: Path) -> list[NDArray[Any]]:
    """Return the frames of each segment of a file; one segment, all frames, in one pass."""
    n, m = len(content.boxes), len(on.boxes)
    if not content.protocol and n != m:
        row = kind.row
        where = f"ends after {row} {n}" if n < m else f"{row} {m + 1} is one too many"
        raise ExchangeError(f"{file}: {n} rows for the {m} frames of {on.name}: {where}.")
    segments = [np.arange(m)]
    if content.headers and kind.frames:
        segments = kind.frames(content.headers, on)
    present = _present(on)
    for header, frames in zip(content.headers, segments, strict=False):
        if content.protocol == "sre" and present[: frames[0]].any():
            raise ExchangeError(
                f"{header.place}: {header.rows} rows. Expected: {m}, the frames of {on.name}, as "
                "every segment of SRE has. Supply all rows."
            )
        if not present[frames].any():
            raise ExchangeError(
                f"{header.place}: the ground truth of {on.name} has no target from frame "
                f"{frames[0]} on. Expected: a segment with a target. Remove it."
            )
    return segments


def _boxes(
    kind: Layout,
    content: Said,
    on: On,
    segments: Sequence[NDArray[Any]],
    file: Path,
    tell: Callable[[str], None],
) -> NDArray[np.float64]:
    """Return boxes in our numbers, by segment from the box at initialisation on."""
    boxes, present = content.boxes.copy(), _present(on)
    moved = parse_protocol("sre").segments(present, {}) if content.protocol == "sre" else None
    rows, first_boxes, end = [], [], 0
    for number, frames in enumerate(segments):
        first = int(present[frames].argmax())
        row, start, end = end + first, end, end + len(frames)
        expected = on.boxes[frames[first]]
        expected = moved[number].perturbed_box(expected) if moved else expected
        place = content.headers[number].place if content.headers else str(file)
        first_boxes.append(FirstBox(place, expected, content.boxes[row]))
        boxes[start:row] = np.nan
        rows.append(row)
    message = check_first_boxes(first_boxes, content.boxes, kind.held)
    origin = origin_of(first_boxes, kind.held)
    if origin is None and any(np.isfinite(box.stored).all() for box in first_boxes):
        message += message and " "
        message += (
            f"{file}: the first box does not show whether pixels count from 0 or from 1; they are "
            f"taken to count from {kind.origin}."
        )
    if message:
        tell(message)
    boxes[:, :2] -= kind.origin if origin is None else origin
    for row, box in zip(rows, first_boxes, strict=True):
        if not moved or not np.isfinite(boxes[row]).all():
            boxes[row] = box.expected
    return boxes


def _present(on: On) -> NDArray[np.bool_]:
    """Return where the sequence has a target."""
    return np.asarray(np.isfinite(on.boxes).all(axis=1))


def _stored_protocol(
    content: Said, segments: Sequence[NDArray[Any]], on: On, file: Path, tell: Callable[[str], None]
) -> str:
    """Return the text of the protocol that a run is filed under.

    Starts of `tre` that our protocol does not choose are kept as they are: other toolkits choose
    others.
    """
    if content.protocol != "tre":
        return content.protocol or STORED_ONE_PASS
    present = _present(on)
    starts = [int(present.argmax()) if frames[0] == 0 else int(frames[0]) for frames in segments]
    for text in ("tre", f"tre:starts={len(segments)}"):
        chosen = parse_protocol(text).segments(present, {})
        if [segment.start or int(present.argmax()) for segment in chosen] == starts:
            return text
    if len(segments) != _STARTS_OF_TRE:
        tell(f"{file}: {len(segments)} segments of TRE, which has {_STARTS_OF_TRE} in the toolkit.")
    return "tre"


def _padded(run: Run, on: On) -> Run:
    """Return a run whose segment from the first frame with a target covers the whole sequence.

    So segments over the whole sequence are stored by every protocol.
    """
    first = int(_present(on).argmax())
    segments, before, row = [], [], 0
    for frames in run.segments:
        whole = first > 0 and frames[0] == first and len(frames) == len(on.boxes) - first
        segments.append(np.arange(len(on.boxes)) if whole else frames)
        before += [row] * (first if whole else 0)
        row += len(frames)
    if not before:
        return run
    return replace(
        run,
        boxes=np.insert(run.boxes, before, np.nan, axis=0),
        visible=np.insert(run.visible, before, values=False),
        confidence=np.insert(run.confidence, before, np.nan),
        segments=tuple(segments),
    )
