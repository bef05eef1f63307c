"""Baselines: scores of trackers in a text file that is committed and reviewed.

A baseline has a score for each pair of a tracker and a sequence: the mean overlap and a digest of
the boxes of each run.
Repetitions count from 0, so that an unchanged tracker gives equal boxes.
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

from trackmark.bench.experiments.experiment import SequenceSpec, check_folder_name, read_toml
from trackmark.bench.output_files import write_file
from trackmark.bench.statistics.accuracy_drop import MAX_REPETITIONS
from trackmark.bench.statistics.rules import MIN_UNITS
from trackmark.bench.store.database import ResultsError
from trackmark.bench.store.runs import Runs, RunWithTruth
from trackmark.datasets.source_digest import library_version

FORMAT = 1

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
class BaselineScore:
    """Runs of a tracker on a sequence by repetition; a deterministic tracker has one run."""

    source: SequenceSpec
    fingerprint: str  # digest of pixels and ground truth
    overlap: tuple[float, ...]  # mean overlaps; 0 for a failed run
    box_digests: tuple[str, ...]  # empty for a failed run
    # reasons of failures by repetition; not stored in the file
    failures: Mapping[int, str] = field(default_factory=dict)


BaselineScores = Mapping[str, Mapping[str, BaselineScore]]
"""Scores by label of the tracker and name of the sequence."""


@dataclass(frozen=True)
class Baseline:
    """Scores of trackers on sequences, with the platform and libraries of the runs."""

    scores: BaselineScores
    specs: Mapping[str, str]  # specifications of the trackers, by label
    n_repetitions: int  # number of runs of each stochastic tracker
    detectable_drop: float  # drop of the mean overlap on one sequence to detect
    environment: Mapping[str, str]  # platform, Python and libraries
    accepted: Sequence[Mapping[str, Any]] = ()  # accepted changes with reasons

    def with_repetitions(self, n_repetitions: int) -> "Baseline":
        """Return the baseline restricted to the first repetitions."""
        scores = {
            tracker: {
                name: replace(
                    score,
                    overlap=score.overlap[:n_repetitions],
                    box_digests=score.box_digests[:n_repetitions],
                )
                for name, score in row.items()
            }
            for tracker, row in self.scores.items()
        }
        return replace(self, scores=scores, n_repetitions=n_repetitions)

    def with_accepted(
        self, tracker: str, now: BaselineScores, reason: str, date: str
    ) -> "Baseline":
        """Return the baseline with new scores of a tracker and the reason for the change."""
        by_sequence = [
            [np.mean(score.overlap) for score in scores[tracker].values()]
            for scores in (self.scores, now)
        ]
        overlap = [round(float(np.mean(means)), DECIMALS) for means in by_sequence]
        change = {"tracker": tracker, "date": date, "reason": reason, "overlap": overlap}
        scores = {**self.scores, tracker: now[tracker]}
        return replace(self, scores=scores, accepted=(*self.accepted, change))


def baseline_path(name: str) -> Path:
    """Return the file of a baseline: a path that ends in `.toml`, or a name in `baselines`.

    Raises `ExperimentError` for a name that is empty or has, for example, a slash. The file name of
    a path without its suffix has the same rule, because it names the results folder.
    """
    is_path = name.endswith(".toml")
    path = Path(name) if is_path else FOLDER / f"{name}.toml"
    check_folder_name(path.stem if is_path else name, "baseline", ", or a path that ends in .toml")
    return path


def current_environment() -> dict[str, str]:
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


def digest(encoded: bytes) -> str:
    """Return a short digest of bytes or of a fingerprint."""
    return hashlib.sha256(encoded).hexdigest()[:_DIGITS]


def stored_scores(
    folder: Path, runs: Mapping[tuple[str, str], int], sources: Mapping[str, SequenceSpec]
) -> BaselineScores:
    """Return the scores of the stored runs of an experiment.

    `runs` gives the number of repetitions by tracker and sequence, and `sources` the specification
    of each sequence by name.

    Raises `BaselineError` for a finished run without a score.
    """
    stored_runs = Runs.open(folder)
    by_pair: dict[tuple[str, str], dict[int, RunWithTruth]] = {pair: {} for pair in runs}
    rows = (  # the runs of the current versions were just stored
        row
        for row in stored_runs.stored_rows
        if row["protocol"] == "one-pass"
        and row["repetition"] < runs.get((row["tracker"], row["sequence"]), 0)
    )
    for run in stored_runs.read(rows):
        by_pair[run.row["tracker"], run.row["sequence"]][run.row["repetition"]] = run
    scores: dict[str, dict[str, BaselineScore]] = {}
    for (tracker, name), by_repetition in by_pair.items():
        ordered = [by_repetition[repetition] for repetition in range(runs[tracker, name])]
        scores.setdefault(tracker, {})[name] = _score(sources[name], ordered)
    return scores


def _score(source: SequenceSpec, runs: Sequence[RunWithTruth]) -> BaselineScore:
    overlap, box_digests, failures = [0.0] * len(runs), [""] * len(runs), {}
    for repetition, (row, run, _) in enumerate(runs):
        if row["status"] != "finished":
            failures[repetition] = str(row["failure"]).partition("\n")[0]
            continue
        overlap_of_run = float(row["scores"].get("mean_overlap", np.nan))
        if not np.isfinite(overlap_of_run):
            raise BaselineError(
                f"{row['tracker']} on {row['sequence']}: the run has no mean overlap. Leave out "
                "the sequence: its ground truth has no box after the first one."
            )
        overlap[repetition] = round(overlap_of_run, DECIMALS)
        box_digests[repetition] = box_digest(run.boxes)
    fingerprint = digest(runs[0].row["fingerprint"].encode())
    return BaselineScore(source, fingerprint, tuple(overlap), tuple(box_digests), failures)


def write_baseline(baseline: Baseline, path: Path) -> None:
    """Write a baseline; equal baselines give equal bytes.

    Raises `BaselineError` for a text that is not valid UTF-8.
    """
    toml = "\n".join(_lines(baseline)) + "\n"
    try:
        encoded = toml.encode("utf-8")
    except UnicodeEncodeError as error:
        raise BaselineError(
            f"{path}: {toml[error.start - 20 : error.end]!r} is not valid UTF-8. Rename the file "
            "or folder, or give another reason."
        ) from None
    write_file(path, encoded)


def _lines(baseline: Baseline) -> Iterator[str]:
    yield "# Baseline of trackmark: `trackmark check` compares trackers with it."
    yield "# Each sequence: mean overlap and digest of the boxes, by repetition from 0 on."
    yield f"format = {FORMAT}"
    yield f"repetitions = {baseline.n_repetitions}"
    yield f"detectable_drop = {baseline.detectable_drop!r}"
    yield "\n[environment]"
    yield from _toml_lines(baseline.environment)
    if renamed := {label: spec for label, spec in baseline.specs.items() if spec != label}:
        yield "\n# Specifications of trackers with other names."
        yield "[specifications]"
        yield from _toml_lines(renamed)
    for tracker, scores in baseline.scores.items():
        yield f"\n[trackers.{_toml(tracker)}]"
        for name, score in scores.items():
            yield f"{_toml(name)} = {_inline(name, score)}"
    for change in baseline.accepted:
        yield "\n[[accepted]]"
        yield from (f"{key} = {_toml(value)}" for key, value in change.items())


def _toml_lines(values: Mapping[str, str]) -> list[str]:
    return [f"{_toml(key)} = {_toml(value)}" for key, value in values.items()]


def _inline(name: str, score: BaselineScore) -> str:
    fields: dict[str, object] = {
        "fingerprint": score.fingerprint,
        "overlap": score.overlap,
        "box_digests": score.box_digests,
    }
    if score.source.spec != name:
        fields["path"] = score.source.spec
    if score.source.truth is not None:
        fields["truth"] = str(score.source.truth)
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


class _FileScore(_Strict):
    fingerprint: _Digest
    overlap: Annotated[list[_Score], Field(min_length=1)]
    box_digests: list[_Digest]
    path: _Text | None = None
    truth: _Text | None = None

    def baseline_score(self, name: str) -> BaselineScore:
        """Return the score as `BaselineScore`; `name` is the sequence if the file has no path."""
        source = SequenceSpec(self.path or name, Path(self.truth) if self.truth else None)
        return BaselineScore(source, self.fingerprint, tuple(self.overlap), tuple(self.box_digests))


def _check_date(day: str) -> str:
    """Return a date; `ValueError` for a day that does not exist becomes a `ValidationError`."""
    date.fromisoformat(day)
    return day


class _FileAccepted(_Strict):
    tracker: _Text
    date: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\d$"), AfterValidator(_check_date)]
    reason: _Text
    overlap: Annotated[list[_Score], Field(min_length=2, max_length=2)]


class _File(_Strict):
    format: int
    repetitions: Annotated[int, Field(ge=MIN_UNITS, le=MAX_REPETITIONS)]
    detectable_drop: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)]
    environment: _Texts
    specifications: _Texts = {}
    trackers: Annotated[
        dict[_Text, Annotated[dict[_Text, _FileScore], Field(min_length=1)]], Field(min_length=1)
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
        validated = _File.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        value = "missing" if first["type"] == "missing" else first["input"]
        _refuse(path, _location(first["loc"]), value, f"{first['msg']}.")
    for tracker, row in validated.trackers.items():
        _check_lengths(path, validated.repetitions, tracker, row)
    _check_sources(path, validated)
    scores = {
        tracker: {name: score.baseline_score(name) for name, score in row.items()}
        for tracker, row in validated.trackers.items()
    }
    specs = {label: validated.specifications.get(label, label) for label in scores}
    accepted = tuple(change.model_dump() for change in validated.accepted)
    return Baseline(
        scores,
        specs,
        validated.repetitions,
        validated.detectable_drop,
        validated.environment,
        accepted,
    )


def _check_lengths(
    path: Path, n_repetitions: int, tracker: str, scores: Mapping[str, _FileScore]
) -> None:
    """Raise `BaselineError` unless a tracker has 1 run or one per repetition on every sequence."""
    (first, *_) = scores.values()
    n = len(first.overlap)
    for name, score in scores.items():
        for key, values in (("overlap", score.overlap), ("box_digests", score.box_digests)):
            if n not in (1, n_repetitions) or len(values) != n:
                runs = (
                    f"1 or {n_repetitions} (one per repetition)"
                    if n not in (1, n_repetitions)
                    else f"{n}, one per run"
                )
                location = _location(("trackers", tracker, name, key))
                _refuse(path, location, values, f"{len(values)} values; expected {runs}.")


def _check_sources(path: Path, validated: _File) -> None:
    """Raise `BaselineError` if trackers disagree on a sequence, or a specification has no use."""
    first_of: dict[str, tuple[str, _FileScore]] = {}
    for tracker, row in validated.trackers.items():
        for name, score in row.items():
            first, expected = first_of.setdefault(name, (tracker, score))
            for key in ("fingerprint", "path", "truth"):
                value, other = getattr(score, key), getattr(expected, key)
                if value != other:
                    location = _location(("trackers", tracker, name, key))
                    _refuse(path, location, value, f"Tracker {first!r} has {other!r}.")
    for label in validated.specifications:
        if label not in validated.trackers:
            _refuse(path, "specifications", label, "The file has no scores of this tracker.")


def check_equal_scores(path: Path, before: BaselineScores, now: BaselineScores) -> None:
    """Raise `BaselineError` if runs with equal boxes have another overlap than in the baseline.

    `now` contains the scores of the same trackers on the same, unchanged sequences, so that equal
    boxes must give equal overlaps. The message names `path`, the file of the baseline.
    """
    for tracker, row in before.items():
        for name, old in row.items():
            new = now[tracker][name]
            # The only run of a deterministic tracker counts for all repetitions.
            runs = np.broadcast_arrays(old.box_digests, new.box_digests, old.overlap, new.overlap)
            for repetition, (old_boxes, new_boxes, old_overlap, new_overlap) in enumerate(
                zip(*runs, strict=True)
            ):
                if old_boxes == new_boxes and abs(old_overlap - new_overlap) > MAX_OVERLAP_ERROR:
                    location = _location(("trackers", tracker, name, f"overlap.{repetition}"))
                    expected = f"Runs with these boxes have a mean overlap of {new_overlap} now."
                    _refuse(path, location, float(old_overlap), expected)


def _location(keys: Sequence[int | str]) -> str:
    """Return the place of a key in the file, in words, for messages."""
    if keys[0] != "trackers" or len(keys) < 2:
        return ".".join(map(str, keys))
    kinds = zip(("tracker", "sequence"), keys[1:3], strict=False)
    names = [f"{kind} {name!r}" for kind, name in kinds]
    return ", ".join(filter(None, [*names, ".".join(map(str, keys[3:]))]))


def _refuse(path: Path, location: str, value: object, expected: str) -> NoReturn:
    printed = repr(value)
    printed = printed if len(printed) <= 80 else f"{printed[:77]}..."
    raise BaselineError(f"{path}: {location}: {printed}. {expected} {_REMEDY}")
