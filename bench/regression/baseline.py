"""Baselines: scores of trackers in a text file that is committed and reviewed.

An entry is a tracker–sequence pair, with the mean overlap and a digest of the boxes of each run.
Seeds count from 0, so that an unchanged tracker gives equal boxes.
"""

import hashlib
import json
import platform
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Annotated, Any, NoReturn

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from trackmark.bench.experiments.experiment import SequenceSource, check_folder_name, read_toml
from trackmark.bench.statistics.accuracy_drop import MAX_SEEDS
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.store.files import ResultsError
from trackmark.bench.store.layout import run_key
from trackmark.bench.store.results import Results
from trackmark.bench.store.run_rows import list_scored_runs
from trackmark.datasets.source_digest import library_version
from trackmark.reports.files import write_file

FORMAT = 2

DECIMALS = 5
"""Decimals of a stored mean overlap."""

LIBRARIES = {"numpy": "numpy", "numba": "numba", "opencv": "cv2", "scipy": "scipy"}
"""Import names of libraries that can change boxes, by their names in baselines."""

FOLDER = Path("baselines")

MAX_OVERLAP_ERROR = 1e-4
"""Largest difference of the overlaps of equal boxes: scores are rounded to five decimals, and boxes
to a thousandth of a pixel.
"""

_DIGITS = 8  # hexadecimal digits of a stored digest
_NO_BOX = -(2**31)
_REMEDY = "Restore the file, or recreate it with `trackmark baseline --force`."


class BaselineError(ResultsError):
    """Error of a baseline that cannot be read or does not fit the current data."""


@dataclass(frozen=True)
class BaselineEntry:
    """Runs of a tracker on a sequence by seed; a deterministic tracker has one run."""

    source: SequenceSource
    sequence: str  # digest of pixels and ground truth
    overlap: tuple[float, ...]  # mean overlaps; 0 for a failed run
    boxes: tuple[str, ...]  # digests of boxes; empty for a failed run
    # reasons of failures by seed; not stored in the file
    failures: Mapping[int, str] = field(default_factory=dict)


BaselineEntries = Mapping[str, Mapping[str, BaselineEntry]]
"""Entries by label of the tracker and name of the sequence."""


@dataclass(frozen=True)
class Baseline:
    """Scores of trackers on sequences, with the platform and libraries of the runs."""

    entries: BaselineEntries
    texts: Mapping[str, str]  # specifications of the trackers, by label
    seeds: int  # number of runs of each stochastic tracker
    detect: float  # drop of the mean overlap on one sequence to detect
    made_with: Mapping[str, str]  # platform, Python and libraries
    accepted: Sequence[Mapping[str, Any]] = ()  # accepted changes with reasons

    def with_seeds(self, seeds: int) -> "Baseline":
        """Return the baseline restricted to the first seeds."""
        entries = {
            tracker: {
                name: replace(entry, overlap=entry.overlap[:seeds], boxes=entry.boxes[:seeds])
                for name, entry in row.items()
            }
            for tracker, row in self.entries.items()
        }
        return replace(self, entries=entries, seeds=seeds)

    def moved_on(self, tracker: str, now: BaselineEntries, reason: str, date: str) -> "Baseline":
        """Return the baseline with new entries of a tracker and the reason for the change."""
        by_sequence = [
            [np.mean(entry.overlap) for entry in entries[tracker].values()]
            for entries in (self.entries, now)
        ]
        overlap = [round(float(np.mean(means)), DECIMALS) for means in by_sequence]
        change = {"tracker": tracker, "date": date, "because": reason, "overlap": overlap}
        entries = {**self.entries, tracker: now[tracker]}
        return replace(self, entries=entries, accepted=(*self.accepted, change))


def baseline_path(name: str) -> Path:
    """Return the file of a baseline: a path that ends in `.toml`, or a name in `baselines`.

    Raises `ExperimentError` for a name that is empty or has, for example, a slash. The file name of
    a path without its suffix has the same rule, because it names the results folder.
    """
    is_path = name.endswith(".toml")
    path = Path(name) if is_path else FOLDER / f"{name}.toml"
    check_folder_name(path.stem if is_path else name, "baseline", ", or a path that ends in .toml")
    return path


def surroundings() -> dict[str, str]:
    """Return platform, Python version and libraries, on which boxes can depend."""
    return {
        "platform": f"{platform.system()} {platform.machine()}",
        "python": ".".join(map(str, sys.version_info[:2])),
        **{name: library_version(module) for name, module in LIBRARIES.items()},
    }


def box_digest(boxes: NDArray[np.float64]) -> str:
    """Return the digest of the boxes of a run, shape (n, 4), in thousandths of a pixel.

    Boxes are clipped to int32; a frame without a box has the smallest int32 in all four columns.
    """
    limits = np.iinfo(np.int32)
    with np.errstate(over="ignore"):
        scaled = np.clip(np.rint(boxes * 1000), limits.min, limits.max)
    absent = np.isnan(boxes).any(axis=1, keepdims=True)
    return digest(np.where(absent, _NO_BOX, scaled).astype("<i4").tobytes())


def digest(content: bytes) -> str:
    """Return a short digest of bytes or of a fingerprint."""
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def stored_entries(
    folder: Path, runs: Mapping[tuple[str, str], int], sources: Mapping[str, SequenceSource]
) -> BaselineEntries:
    """Return the entries of the stored runs of an experiment.

    `runs`: number of seeds by tracker and sequence. `sources`: specifications of the sequences, by
    name.

    Raises `BaselineError` for a finished run without a score.
    """
    results = Results(folder)
    rows: dict[tuple[str, str], dict[int, Mapping[str, Any]]] = {pair: {} for pair in runs}
    for row in list_scored_runs(results):  # the runs of the current versions were just stored
        pair = row["tracker"], row["sequence"]
        if row["protocol"] == "accuracy" and row["repetition"] < runs.get(pair, 0):
            rows[pair][row["repetition"]] = row
    entries: dict[str, dict[str, BaselineEntry]] = {}
    for (tracker, name), by_seed in rows.items():
        ordered = [by_seed[seed] for seed in range(runs[tracker, name])]
        entries.setdefault(tracker, {})[name] = _entry(results, sources[name], ordered)
    return entries


def _entry(
    results: Results, source: SequenceSource, rows: Sequence[Mapping[str, Any]]
) -> BaselineEntry:
    overlap, boxes, failures = [0.0] * len(rows), [""] * len(rows), {}
    for seed, row in enumerate(rows):
        if row["status"] != "finished":
            failures[seed] = str(row["failure"]).partition("\n")[0]
            continue
        score = float(row["scores"].get("mean_overlap", np.nan))
        if not np.isfinite(score):
            raise BaselineError(
                f"{row['tracker']} on {row['sequence']}: the run has no mean overlap. Leave out "
                "the sequence: its ground truth has no box after the first one."
            )
        overlap[seed] = round(score, DECIMALS)
        boxes[seed] = box_digest(results.read(run_key(row)).boxes)
    sequence = digest(rows[0]["fingerprint"].encode())
    return BaselineEntry(source, sequence, tuple(overlap), tuple(boxes), failures)


def write_baseline(baseline: Baseline, path: Path) -> None:
    """Write a baseline; equal baselines give equal bytes.

    Raises `BaselineError` for a text that is not valid UTF-8.
    """
    text = "\n".join(_lines(baseline)) + "\n"
    try:
        content = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise BaselineError(
            f"{path}: {text[error.start - 20 : error.end]!r} is not valid UTF-8. Rename the file "
            "or folder, or give another reason."
        ) from None
    write_file(path, lambda file: file.write_bytes(content))


def _lines(baseline: Baseline) -> Iterator[str]:
    yield "# Baseline of trackmark: `trackmark check` compares trackers with it."
    yield "# Each sequence: mean overlap and digest of the boxes by seed, from seed 0 on."
    yield f"format = {FORMAT}"
    yield f"seeds = {baseline.seeds}"
    yield f"detect = {baseline.detect!r}"
    yield "\n[made_with]"
    yield from _toml_lines(baseline.made_with)
    if texts := {label: text for label, text in baseline.texts.items() if text != label}:
        yield "\n# Specifications of trackers with other names."
        yield "[specifications]"
        yield from _toml_lines(texts)
    for tracker, entries in baseline.entries.items():
        yield f"\n[trackers.{_toml(tracker)}]"
        for name, entry in entries.items():
            yield f"{_toml(name)} = {_inline(name, entry)}"
    for change in baseline.accepted:
        yield "\n[[accepted]]"
        yield from (f"{key} = {_toml(value)}" for key, value in change.items())


def _toml_lines(texts: Mapping[str, str]) -> list[str]:
    return [f"{_toml(key)} = {_toml(text)}" for key, text in texts.items()]


def _inline(name: str, entry: BaselineEntry) -> str:
    fields: dict[str, object]
    fields = {"sequence": entry.sequence, "overlap": entry.overlap, "boxes": entry.boxes}
    if entry.source.text != name:
        fields["path"] = entry.source.text
    if entry.source.truth is not None:
        fields["truth"] = str(entry.source.truth)
    return "{ " + ", ".join(f"{key} = {_toml(value)}" for key, value in fields.items()) + " }"


def _toml(value: object) -> str:
    # JSON does not escape DEL, which TOML forbids.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


_Score = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
_Digest = Annotated[str, Field(pattern=rf"^[0-9a-f]{{{_DIGITS}}}$")]
_Text = Annotated[str, Field(min_length=1)]
_Texts = dict[_Text, _Text]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _FileEntry(_Strict):
    sequence: _Digest
    overlap: Annotated[list[_Score], Field(min_length=1)]
    boxes: list[_Digest]
    path: _Text | None = None
    truth: _Text | None = None

    def stored(self, name: str) -> BaselineEntry:
        """Return the entry as `BaselineEntry`; `name` is the sequence if the entry has no path."""
        source = SequenceSource(self.path or name, Path(self.truth) if self.truth else None)
        return BaselineEntry(source, self.sequence, tuple(self.overlap), tuple(self.boxes))


def _check_date(text: str) -> str:
    """Return a date; `ValueError` for a day that does not exist becomes a `ValidationError`."""
    date.fromisoformat(text)
    return text


class _FileAccepted(_Strict):
    tracker: _Text
    date: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\d$"), AfterValidator(_check_date)]
    because: _Text
    overlap: Annotated[list[_Score], Field(min_length=2, max_length=2)]


class _File(_Strict):
    format: int
    seeds: Annotated[int, Field(ge=MIN_UNITS, le=MAX_SEEDS)]
    detect: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
    made_with: _Texts
    specifications: _Texts = {}
    trackers: Annotated[
        dict[_Text, Annotated[dict[_Text, _FileEntry], Field(min_length=1)]], Field(min_length=1)
    ]
    accepted: list[_FileAccepted] = []


def read_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises `BaselineError` with file, place, value and expectation.
    """
    if not path.is_file():
        raise BaselineError(f"{path}: baseline not found. Create it with `trackmark baseline`.")
    try:
        table = read_toml(path, BaselineError)
    except BaselineError as error:
        raise BaselineError(f"{error} {_REMEDY}") from None
    if table.get("format") != FORMAT:
        _refuse(path, "format", table.get("format"), f"This version reads format {FORMAT}.")
    try:
        content = _File.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        value = "missing" if first["type"] == "missing" else first["input"]
        _refuse(path, _place(first["loc"]), value, f"{first['msg']}.")
    for tracker, row in content.trackers.items():
        _check_lengths(path, content.seeds, tracker, row)
        _check_equal_boxes(path, tracker, row)
    _check_sources(path, content)
    entries = {
        tracker: {name: entry.stored(name) for name, entry in row.items()}
        for tracker, row in content.trackers.items()
    }
    texts = {label: content.specifications.get(label, label) for label in entries}
    accepted = tuple(change.model_dump() for change in content.accepted)
    return Baseline(entries, texts, content.seeds, content.detect, content.made_with, accepted)


def _check_lengths(path: Path, seeds: int, tracker: str, entries: Mapping[str, _FileEntry]) -> None:
    """Raise `BaselineError` unless a tracker has 1 run, or one per seed, on every sequence."""
    (first, *_) = entries.values()
    n = len(first.overlap)
    for name, entry in entries.items():
        for key, values in (("overlap", entry.overlap), ("boxes", entry.boxes)):
            if n not in (1, seeds) or len(values) != n:
                runs = (
                    f"1 or {seeds} (one per seed)" if n not in (1, seeds) else f"{n}, one per run"
                )
                place = _place(("trackers", tracker, name, key))
                _refuse(path, place, values, f"{len(values)} values; expected {runs}.")


def _check_equal_boxes(path: Path, tracker: str, entries: Mapping[str, _FileEntry]) -> None:
    """Raise `BaselineError` if two runs of a tracker have equal boxes and different overlaps."""
    for name, entry in entries.items():
        overlap_of: dict[str, float] = {}
        for seed, (boxes, overlap) in enumerate(zip(entry.boxes, entry.overlap, strict=True)):
            expected = overlap_of.setdefault(boxes, overlap)
            if abs(overlap - expected) > MAX_OVERLAP_ERROR:
                place = _place(("trackers", tracker, name, f"overlap.{seed}"))
                _refuse(path, place, overlap, f"Another run with equal boxes has {expected}.")


def _check_sources(path: Path, content: _File) -> None:
    """Raise `BaselineError` if trackers disagree on a sequence, or a specification has no use."""
    first_of: dict[str, tuple[str, _FileEntry]] = {}
    for tracker, row in content.trackers.items():
        for name, entry in row.items():
            first, expected = first_of.setdefault(name, (tracker, entry))
            for key in ("sequence", "path", "truth"):
                value, other = getattr(entry, key), getattr(expected, key)
                if value != other:
                    place = _place(("trackers", tracker, name, key))
                    _refuse(path, place, value, f"Tracker {first!r} has {other!r}.")
    for label in content.specifications:
        if label not in content.trackers:
            _refuse(path, "specifications", label, "The file has no scores of this tracker.")


def check_equal_scores(path: Path, before: BaselineEntries, now: BaselineEntries) -> None:
    """Raise `BaselineError` if runs with equal boxes have another overlap than in the baseline.

    `now`: entries of the same trackers and sequences. The sequences have not changed. `path`: file
    of the baseline, for the message.
    """
    for tracker, row in before.items():
        for name, old in row.items():
            new = now[tracker][name]
            # The only run of a deterministic tracker counts for all seeds.
            runs = np.broadcast_arrays(old.boxes, new.boxes, old.overlap, new.overlap)
            for seed, (old_boxes, new_boxes, stored, current) in enumerate(zip(*runs, strict=True)):
                if old_boxes == new_boxes and abs(stored - current) > MAX_OVERLAP_ERROR:
                    place = _place(("trackers", tracker, name, f"overlap.{seed}"))
                    expected = f"Runs with these boxes have a mean overlap of {current} now."
                    _refuse(path, place, float(stored), expected)


def _place(location: Sequence[int | str]) -> str:
    """Return the place of a key in the file, in words, for messages."""
    if location[0] != "trackers" or len(location) < 2:
        return ".".join(map(str, location))
    kinds = zip(("tracker", "sequence"), location[1:3], strict=False)
    names = [f"{kind} {name!r}" for kind, name in kinds]
    return ", ".join(filter(None, [*names, ".".join(map(str, location[3:]))]))


def _refuse(path: Path, place: str, value: object, expected: str) -> NoReturn:
    text = repr(value)
    text = text if len(text) <= 80 else f"{text[:77]}..."
    raise BaselineError(f"{path}: {place}: {text}. {expected} {_REMEDY}")
