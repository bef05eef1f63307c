"""Baselines: what trackers scored when all was well, in a small text file made to be reviewed.

A line is a cell: a tracker on a sequence, with the digest of its boxes and, by metric, mean and
standard deviation over its repetitions. Seeds are the first ones, so that an unchanged tracker
gives the same boxes again.
"""

import hashlib
import json
import math
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from bench.experiments.experiment import SequenceSource, read_toml
from bench.statistics.regression import Sample, repetitions_for
from bench.store.files import ResultsError
from bench.store.loading import ordered_rows
from bench.store.results import Results
from reports.files import write_file

__all__ = [
    "DECISIVE",
    "METRICS",
    "Baseline",
    "BaselineCell",
    "BaselineError",
    "Design",
    "Speed",
    "baseline_path",
    "lacking",
    "measured",
    "read_baseline",
    "surroundings",
    "write_baseline",
]

FORMAT = 1

METRICS = ("mean_overlap", "success_share", "centre_error")
"""Scores that a baseline keeps; the first decides."""

DECISIVE = METRICS[0]

LIBRARIES = ("numpy", "numba", "opencv-python-headless", "scipy")

FOLDER = Path("baselines")

TEXT_KEY = "tracker"
"""Of a tracker's text, where its label alone would not make it again."""


class BaselineError(ResultsError):
    """A baseline that can't be read, or does not fit what is there; says what to do."""


@dataclass(frozen=True)
class BaselineCell:
    """A tracker on a sequence."""

    source: SequenceSource
    fingerprint: str  # of the sequence: pixels and truth
    boxes: str  # digest over all repetitions' boxes
    scores: Mapping[str, Sample]  # by metric
    failed: int = 0  # runs that failed; their overlap counts as 0
    reason: str = ""  # why the first of them did


class Speed(NamedTuple):
    """Time of a tracker's updates, as a multiple of a reference's, on a processor."""

    sample: Sample  # logs of the ratio, a session each
    processor: str


@dataclass(frozen=True)
class Baseline:
    """What was scored, by tracker's label and sequence's name."""

    cells: Mapping[str, Mapping[str, BaselineCell]]
    texts: Mapping[str, str]  # of the trackers, by label: what makes them again
    detect: float  # smallest drop that its design was made for
    made_with: Mapping[str, str]  # platform, Python and libraries
    accepted: Sequence[Mapping[str, Any]] = field(default_factory=tuple)  # changes, with reasons
    speeds: Mapping[str, Speed] = field(default_factory=dict)  # of trackers that were clocked

    def moved_on(self, tracker: str, now: "Baseline", reason: str, date: str) -> "Baseline":
        """The same with a tracker's new cells, and why they were accepted."""
        before, after = (_mean(found.cells[tracker]) for found in (self, now))
        entry = {
            "tracker": tracker,
            "date": date,
            "because": reason,
            DECISIVE: [_rounded(before), _rounded(after)],
        }
        cells = {**self.cells, tracker: now.cells[tracker]}
        speeds = {**self.speeds, **now.speeds}
        return replace(self, cells=cells, accepted=(*self.accepted, entry), speeds=speeds)


def baseline_path(name: str) -> Path:
    """Where a baseline lies: a path ends in `.toml`, a name is a file in `baselines`."""
    return Path(name) if name.endswith(".toml") else FOLDER / f"{name}.toml"


def surroundings() -> dict[str, str]:
    """What boxes may depend on beside trackers and sequences."""
    return {
        "platform": f"{platform.system()} {platform.machine()}",
        "python": ".".join(map(str, sys.version_info[:2])),
        **{name: version(name) for name in LIBRARIES},
    }


Design: TypeAlias = Mapping[tuple[str, str], int]
"""Repetitions by tracker and sequence; trackers that never draw have one anyway."""


def measured(
    folder: Path,
    design: Design,
    texts: Mapping[str, str],
    sources: Mapping[str, SequenceSource],
    detect: float,
    *,
    may_fail: bool,
) -> Baseline:
    """A baseline of an experiment's runs.

    `design` says which are meant, `texts` what makes the trackers again, by label, and `sources`
    where sequences are, by name. Raises `BaselineError`
    for runs that have no score, and for those that failed unless they may.
    """
    results = Results(folder)
    runs: dict[tuple[str, str], list[tuple[int, Mapping[str, Any], bytes]]] = {}
    for row in ordered_rows(results, protocol="accuracy"):
        if row["repetition"] >= design.get((row["tracker"], row["sequence"]), 0):
            continue
        if row["status"] != "finished" and not may_fail:
            raise BaselineError(
                f"{row['tracker']} on {row['sequence']}, repetition {row['repetition']}: "
                f"{row['status']} ({str(row['failure']).partition(chr(10))[0]}). Mend it first."
            )
        boxes = results.read(folder / row["path"]).boxes
        found = runs.setdefault((row["tracker"], row["sequence"]), [])
        found.append((row["repetition"], row, np.ascontiguousarray(boxes).tobytes()))
    cells: dict[str, dict[str, BaselineCell]] = {}
    for tracker, sequence in design:
        found = runs[tracker, sequence]
        cell = _cell(sources[sequence], sorted(found, key=lambda run: run[0]))
        cells.setdefault(tracker, {})[sequence] = cell
    return Baseline(cells, texts, detect, surroundings())


def lacking(now: Baseline) -> dict[tuple[str, str], float]:
    """Repetitions that cells need and don't have to show a drop of `detect`, by cell."""
    samples = {
        (tracker, name): cell.scores[DECISIVE]
        for tracker, found in now.cells.items()
        for name, cell in found.items()
    }
    drawn = {cell: sample for cell, sample in samples.items() if sample.spread > 0}
    needed = {
        cell: float(repetitions_for(sample, now.detect, len(drawn)))
        for cell, sample in drawn.items()
    }
    return {cell: number for cell, number in needed.items() if number > drawn[cell].n}


def _cell(
    source: SequenceSource, runs: Sequence[tuple[int, Mapping[str, Any], bytes]]
) -> BaselineCell:
    digest = hashlib.sha256()
    for _, _, boxes in runs:
        digest.update(boxes)
    _, first, _ = runs[0]
    scores = {}
    failed = sum(row["status"] != "finished" for _, row, _ in runs)
    for metric in METRICS:
        lost = float("inf") if metric == "centre_error" else 0.0
        values = np.array([row["scores"].get(metric, lost) for _, row, _ in runs], np.float64)
        if not np.isfinite(values).all() and metric == DECISIVE:
            raise BaselineError(f"{first['tracker']} on {first['sequence']} has no {metric}.")
        with np.errstate(invalid="ignore"):  # an infinite centre error has no spread
            spread = float(values.std(ddof=1)) if len(values) > 1 else 0.0
        scores[metric] = Sample(float(values.mean()), spread, len(values))
    reasons = [str(row["failure"]).partition("\n")[0] for _, row, _ in runs if row["failure"]]
    return BaselineCell(
        source,
        first["fingerprint"][:16],
        digest.hexdigest()[:16],
        scores,
        failed,
        *reasons[:1],
    )


def write_baseline(baseline: Baseline, path: Path) -> None:
    """Write a baseline; equal ones give equal bytes."""
    lines = [
        "# A baseline of trackmark: `trackmark check` compares what trackers score now with it.",
        "# Each metric: mean and standard deviation over the repetitions.",
        f"format = {FORMAT}",
        f"detect = {baseline.detect:g}",
        "",
        "[made_with]",
        *(f"{_quoted(key)} = {_quoted(text)}" for key, text in baseline.made_with.items()),
    ]
    for tracker, cells in baseline.cells.items():
        lines += ["", f"[trackers.{_quoted(tracker)}]"]
        if (text := baseline.texts[tracker]) != tracker:
            lines.append(f"{TEXT_KEY} = {_quoted(text)}")
        lines += [f"{_quoted(name)} = {_inline(name, cell)}" for name, cell in cells.items()]
    if baseline.speeds:
        lines += ["", "# Time of an update as a multiple of the reference's.", "[speeds]"]
    lines += [
        f"{_quoted(tracker)} = {{ ratio = {_number(math.exp(mean))}, spread = {_number(spread)}, "
        f"sessions = {n}, processor = {_quoted(place)} }}"
        for tracker, ((mean, spread, n), place) in baseline.speeds.items()
    ]
    for entry in baseline.accepted:
        lines += ["", "[[accepted]]"]
        lines += [f"{key} = {json.dumps(entry[key], ensure_ascii=False)}" for key in entry]
    text = "\n".join(lines).replace("\x7f", "\\u007f") + "\n"  # JSON leaves it, TOML forbids it
    write_file(path, lambda file: file.write_text(text, encoding="utf-8"))


def _inline(name: str, cell: BaselineCell) -> str:
    parts = [f"runs = {cell.scores[DECISIVE].n}"]
    parts += [
        f"{metric} = [{_number(sample.mean)}, {_number(sample.spread)}]"
        for metric, sample in cell.scores.items()
    ]
    parts += [f"boxes = {_quoted(cell.boxes)}", f"sequence = {_quoted(cell.fingerprint)}"]
    if cell.source.text != name:
        parts.append(f"path = {_quoted(cell.source.text)}")
    if cell.source.truth is not None:
        parts.append(f"truth = {_quoted(str(cell.source.truth))}")
    return "{ " + ", ".join(parts) + " }"


def read_baseline(path: Path) -> Baseline:
    """Read a baseline.

    Raises `BaselineError` naming the file and what is wrong with it.
    """
    if not path.is_file():
        raise BaselineError(f"{path}: there is no such baseline. `trackmark baseline` makes one.")
    told = read_toml(path, BaselineError)
    if told.get("format") != FORMAT:
        raise BaselineError(
            f"{path} has the format {told.get('format')}; this trackmark reads {FORMAT}. Make it "
            "anew with `trackmark baseline`."
        )
    try:
        cells = {
            tracker: {
                name: _read_cell(name, cell) for name, cell in found.items() if name != TEXT_KEY
            }
            for tracker, found in told["trackers"].items()
        }
        texts = {
            label: str(found.get(TEXT_KEY, label)) for label, found in told["trackers"].items()
        }
        accepted = tuple(told.get("accepted", ()))
        speeds = {label: _read_speed(kept) for label, kept in told.get("speeds", {}).items()}
        made_with = dict(told["made_with"])
        return Baseline(cells, texts, float(told["detect"]), made_with, accepted, speeds)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BaselineError(
            f"{path} is no whole baseline ({type(error).__name__}: {error}). Restore it, or make "
            "it anew with `trackmark baseline`."
        ) from error


def _read_cell(name: str, told: Mapping[str, Any]) -> BaselineCell:
    truth = Path(told["truth"]) if "truth" in told else None
    scores = {}
    for metric in METRICS:
        mean, spread = map(float, told[metric])
        scores[metric] = Sample(mean, spread, int(told["runs"]))
    if not math.isfinite(scores[DECISIVE].mean) or scores[DECISIVE].n < 1:
        raise ValueError(f"{name}: {DECISIVE} {told[DECISIVE]}, runs {told['runs']}")
    source = SequenceSource(str(told.get("path", name)), truth)
    return BaselineCell(source, str(told["sequence"]), str(told["boxes"]), scores)


def _read_speed(told: Mapping[str, Any]) -> Speed:
    sample = Sample(math.log(told["ratio"]), float(told["spread"]), int(told["sessions"]))
    if not (math.isfinite(sample.mean) and 0 <= sample.spread < math.inf and sample.n >= 2):
        raise ValueError(f"speed {told}")
    return Speed(sample, str(told["processor"]))


def _mean(cells: Mapping[str, BaselineCell]) -> float:
    return float(np.mean([cell.scores[DECISIVE].mean for cell in cells.values()]))


def _rounded(value: float) -> float:
    return float(_number(value))


def _number(value: float) -> str:
    return f"{value:.6g}"  # TOML writes inf and nan like this, too


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
