"""Experiments: trackers, sequences and repetitions, read from TOML files.

```toml
version = 1
title = "Window rules on an easy target"
protocol = "one-pass"                    # or, for example, "supervised:skip_frames=10"
repetitions = 5                          # of stochastic trackers
trackers = [
    "static",
    { name = "camshift", window = ["fixed", "adaptive"] },       # one tracker per list entry
    { name = "opencv-mil", init = "full", repetitions = 2 },     # other ground truth; fewer runs
]
sequences = [
    "samples/face",
    { name = "plain/target", scene = [0, 1, 2], occlusion = [0, 0.5] },
]
```
"""

import hashlib
import json
import math
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackmark.datasets.catalogue import is_built_in
from trackmark.datasets.decoding import check_name, quote
from trackmark.datasets.spec_string import format_text, name_hint

if TYPE_CHECKING:
    from trackmark.bench.protocols import EvaluationProtocol

FOLDER = Path(__file__).parent
"""Folder of the experiments in the package."""

VERSION = 1

MAX_SWEPT = 1_000_000
"""Maximum number of trackers or sequences to which a table entry of an experiment expands."""

_MAX_NAME = 24  # characters of a tracker or a sequence in the name of a folder


class ExperimentError(ValueError):
    """Invalid experiment; the message names the file and the key."""


@dataclass(frozen=True)
class SequenceSpec:
    """Specification of a sequence.

    Attributes
    ----------
    spec : str
        Name with parameters, or path, as for `datasets.load`.
    truth : Path or None
        Ground-truth file for recorded data without ground truth.
    """

    spec: str
    truth: Path | None = None

    def absolute(self) -> "SequenceSpec":
        """Return the specification with absolute paths."""
        path = Path(self.spec).expanduser()
        spec = self.spec if is_built_in(self.spec) else str(path.absolute())
        return SequenceSpec(spec, self.truth.absolute() if self.truth else None)


@dataclass(frozen=True)
class Experiment:
    """Trackers, sequences and repetitions to run.

    Attributes
    ----------
    name : str
        Name of the results folder.
    trackers : tuple of str
        Specifications of the trackers.
    sequences : tuple of SequenceSpec
        Sequences; relative paths refer to the current folder.
    repetitions : int
        Number of repetitions of stochastic trackers; other trackers run once.
    repetitions_by_tracker : mapping of str to int
        Numbers of repetitions that differ from `repetitions`, by specification of the tracker.
    is_timing : bool
        True if runs are timed one by one. Otherwise, trackers run in lock step.
    title : str
        Title of the report.
    protocol : str
        Protocol, in a form that `bench.protocols.parse_protocol` accepts; timing runs are one-pass.
    keeps_arrays : bool
        True if new runs store masks, contours, particles and maps of trackers.
    """

    name: str
    trackers: tuple[str, ...]
    sequences: tuple[SequenceSpec, ...]
    repetitions: int = 1
    repetitions_by_tracker: Mapping[str, int] = field(default_factory=dict)
    is_timing: bool = False
    title: str = ""
    protocol: str = "one-pass"
    keeps_arrays: bool = False

    @property
    def protocol_key(self) -> str:
        """Key of the protocol in `runs.db`; timing runs have the key `timing`."""
        from trackmark.bench.protocols import TIMING

        return TIMING if self.is_timing else self._protocol.key

    @property
    def time_dependent(self) -> bool:
        """True if runs depend on the time of updates; such runs are executed one by one."""
        return self.is_timing or self._protocol.time_dependent

    @property
    def _protocol(self) -> "EvaluationProtocol":
        from trackmark.bench.protocols import parse_protocol  # a slow import, of NumPy

        return parse_protocol(self.protocol)

    def __post_init__(self) -> None:
        check_folder_name(self.name)
        for count in (self.repetitions, *self.repetitions_by_tracker.values()):
            if count < 1:
                raise ExperimentError(f"{self.name}: repetitions: {count}. Give 1 or more.")
        if not self.trackers or not self.sequences:
            raise ExperimentError(
                f"{self.name}: no tracker or no sequence is given. Give at least one of each."
            )
        for names in (self.trackers, [source.spec for source in self.sequences]):
            ((name, count),) = Counter(names).most_common(1)
            if count > 1:
                raise ExperimentError(f"{self.name}: {quote(name)} is named twice.")
        try:
            one_pass = self.protocol == Experiment.protocol
            one_pass = one_pass or self._protocol.name == Experiment.protocol
        except ValueError as error:
            raise ExperimentError(f"{self.name}: {error}") from None
        if self.keeps_arrays and (self.is_timing or not one_pass):
            raise ExperimentError(
                f"{self.name}: arrays are stored only for one-pass runs without timing. "
                "Omit arrays, or change the protocol."
            )
        if self.is_timing and not one_pass:
            raise ExperimentError(
                f"{self.name}: timing runs are one-pass. Omit the protocol {self.protocol}."
            )


def check_folder_name(name: str, noun: str = "results folder", remedy: str = "") -> None:
    """Raise `ExperimentError` if `name` cannot be that of a results folder or a baseline.

    `noun`: what has the name, in messages. `remedy`: alternative to a valid name.
    """
    check_name(Path(name))
    is_plain = name.isprintable() and name == name.strip() and "/" not in name
    if not (name and is_plain) or name.startswith((".", "_")):
        raise ExperimentError(
            f"{quote(name)} is not a valid name of a {noun}. Use a name without '/', control "
            f"characters and spaces at its ends, which starts with neither '.' nor '_'{remedy}."
        )


def default_name(
    trackers: Sequence[str], sequences: Sequence[str], truth: Path | None = None
) -> str:
    """Return the default name of an experiment; it does not depend on the order of the texts.

    Raises `ExperimentError` if there are no trackers or no sequences.
    """
    if not (trackers and sequences):
        raise ExperimentError("no tracker or no sequence is given. Give at least one of each.")
    trackers = sorted(trackers)
    # Excluded sequences are last, because the first text gives the name.
    sequences = sorted(sequences, key=lambda spec: (spec.startswith("!"), spec))
    identity = json.dumps([trackers, sequences, str(truth or "")])
    digest = hashlib.sha256(identity.encode()).hexdigest()[:6]
    names = [_tracker_name(spec) for spec in trackers]
    return f"{_short_name(names)}-on-{_short_name(sequences)}-{digest}"


def _tracker_name(spec: str) -> str:
    """Return the name that a specification gives, or the specification without interpreter."""
    named = re.search(r":as=([^:]*)", spec)
    return named[1] if named else re.sub(r":python=[^:]*", "", spec)


def _short_name(specs: Sequence[str]) -> str:
    """Return the last part of the first text and the number of other texts: `static+2`."""
    parts = [re.sub(r"[^\w.=]+", "-", part).strip("-._") for part in specs[0].split("/")]
    name = next(filter(None, reversed(parts)), "any")[:_MAX_NAME]
    return f"{name}+{len(specs) - 1}" if len(specs) > 1 else name


def experiment_names() -> list[str]:
    """Return the names of the experiments in the package."""
    return sorted(file.stem for file in FOLDER.glob("*.toml"))


def read_experiment(name_or_path: str | Path) -> Experiment:
    """Read an experiment: one of `experiment_names()`, or a TOML file.

    Raises
    ------
    ExperimentError
        Naming the file and the key that is missing, unknown or of the wrong type.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        name, names = str(name_or_path), experiment_names()
        if name not in names:
            raise ExperimentError(
                f"unknown experiment {name!r}.{name_hint(name, names)} A .toml file is also valid."
            )
        path = FOLDER / f"{name}.toml"
    return _experiment(path, read_toml(path, ExperimentError))


def read_toml(path: Path, error: type[ValueError]) -> dict[str, Any]:
    """Return the content of a TOML file; raise `error` with its name if it is unreadable."""
    try:
        return tomllib.loads(path.read_text("utf-8-sig"))  # BOM of Windows editors
    except OSError as reason:
        raise error(f"{path}: {reason.strerror}.") from None
    except ValueError as reason:  # also UnicodeDecodeError, and integers of over 4300 digits
        raise error(f"{path}: not valid TOML: {reason}.") from None
    except RecursionError:
        raise error(f"{path}: lists or tables are nested too deeply. Use fewer levels.") from None


_TYPES: Mapping[str, type] = {
    "version": int,
    "title": str,
    "protocol": str,
    "repetitions": int,
    "timing": bool,
    "arrays": bool,
    "trackers": list,
    "sequences": list,
}


def _experiment(path: Path, table: dict[str, Any]) -> Experiment:
    for key, value in table.items():
        if key not in _TYPES:
            raise ExperimentError(f"{path}: unknown key {key!r}.{name_hint(key, _TYPES)}")
        if type(value) is not _TYPES[key]:
            raise ExperimentError(f"{path}: {key} must be of type {_TYPES[key].__name__}.")
    for key in ("version", "trackers", "sequences"):
        if key not in table:
            raise ExperimentError(f"{path}: the key {key!r} is missing.")
    if (version := table.pop("version")) != VERSION:
        raise ExperimentError(f"{path}: version {version} is not supported; use {VERSION}.")
    trackers = list(_expanded(path, "trackers", table.pop("trackers"), "repetitions"))
    for spec, n_repetitions in trackers:
        if n_repetitions is not None and type(n_repetitions) is not int:
            raise ExperimentError(f"{path}: trackers: {spec!r}: repetitions must be an integer.")
    sequences = _expanded(path, "sequences", table.pop("sequences"), "truth")
    return Experiment(
        name=path.stem,
        trackers=tuple(spec for spec, _ in trackers),
        sequences=tuple(
            SequenceSpec(spec, None if truth is None else Path(str(truth)))
            for spec, truth in sequences
        ),
        repetitions_by_tracker={
            spec: n_repetitions for spec, n_repetitions in trackers if n_repetitions is not None
        },
        is_timing=table.pop("timing", False),
        keeps_arrays=table.pop("arrays", False),
        **{"title": path.stem} | table,
    )


def _expanded(
    path: Path, list_name: str, items: Iterable[Any], special: str
) -> Iterable[tuple[str, Any]]:
    """Yield the specifications of list items; a table expands to the product of its lists.

    `special` is a key that is not part of the specification; its value is yielded separately.
    """
    count = sum(
        math.prod(len(value) for value in item.values() if isinstance(value, list))
        for item in items
        if isinstance(item, dict)
    )
    if count > MAX_SWEPT:  # checked before the product is computed, which may not fit into memory
        raise ExperimentError(
            f"{path}: {list_name} expands to {count} combinations; the maximum is {MAX_SWEPT}. Use "
            "fewer values."
        )
    for item in items:
        if isinstance(item, str):
            yield item, None
        elif isinstance(item, dict) and isinstance(item.get("name"), str | list):
            options = {"name": item["name"], **item}
            value = options.pop(special, None)
            lists = [level if isinstance(level, list) else [level] for level in options.values()]
            if not all(lists):
                raise ExperimentError(
                    f"{path}: {list_name}: {item!r} contains an empty list. Give at least one "
                    "value."
                )
            for name, *values in product(*lists):
                keys = list(options)[1:]
                yield format_text(str(name), dict(zip(keys, values, strict=True))), value
        else:
            raise ExperimentError(
                f"{path}: {list_name}: {item!r} is neither a text nor a table with the key 'name'."
            )
