"""Experiments: which trackers run on which sequences, how often. Data, read from TOML.

```toml
version = 1
title = "Window rules on an easy target"
protocol = "one-pass"                    # how they are run; another is "supervised:skip=10"
repetitions = 5                          # of trackers that draw random numbers
trackers = [
    "static",
    { name = "camshift", window = ["fixed", "adaptive"] },       # a list is swept
    { name = "opencv-mil", init = "full", repetitions = 2 },     # by another truth; less often
]
sequences = [
    "samples/face",
    { name = "plain/target", scene = [0, 1, 2], occlusion = [0, 0.5] },
]
```
"""

import math
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackmark.datasets.decoding import brief, check_name
from trackmark.datasets.spec_string import close_match, format_text

if TYPE_CHECKING:
    from trackmark.bench.protocols import Protocol

FOLDER = Path(__file__).parent
PAPERS = FOLDER.parent / "papers"
"""A paper's experiments lie in its folder, and are named after both: `<paper>-<file>`."""

VERSION = 1

MOST_SWEPT = 1_000_000
"""Trackers, or sequences, that an experiment's tables may come to."""


class ExperimentError(ValueError):
    """An experiment that can't be read; the message names file and key."""


@dataclass(frozen=True)
class SequenceSource:
    """Where a sequence comes from.

    Attributes
    ----------
    text : str
        Name with variant, or path; as for `datasets.load`.
    truth : Path or None
        Truth file for recorded data that has none of its own.
    """

    text: str
    truth: Path | None = None

    def absolute(self) -> "SequenceSource":
        """The same, wherever it is opened from."""
        from trackmark.datasets.catalogue import (
            is_built_in,  # its suites, which not every caller needs
        )

        path = Path(self.text).expanduser()
        text = self.text if is_built_in(self.text) else str(path.absolute())
        return SequenceSource(text, self.truth.absolute() if self.truth else None)


@dataclass(frozen=True)
class Experiment:
    """What to run.

    Attributes
    ----------
    name : str
        Folder of its results.
    trackers : tuple of str
        Text forms.
    sequences : tuple of SequenceSource
        Paths among them are relative to where the command is typed.
    repetitions : int
        Of every tracker that draws random numbers; the others run once.
    repeated : mapping of str to int
        Repetitions of those trackers, by their text, that have a number of their own.
    timing : bool
        Whether runs are timed, one by one, instead of scored in lock step.
    title : str
        Headline of its report.
    protocol : str
        How trackers are run, as `bench.protocols.protocol` takes it; timing runs are in one pass.
    arrays : bool
        Whether runs that are made keep what trackers tell besides numbers: masks, contours,
        particles, maps. Runs that are there already stay as they are.
    """

    name: str
    trackers: tuple[str, ...]
    sequences: tuple[SequenceSource, ...]
    repetitions: int = 1
    repeated: Mapping[str, int] = field(default_factory=dict)
    timing: bool = False
    title: str = ""
    protocol: str = "one-pass"
    arrays: bool = False

    @property
    def filed_under(self) -> str:
        """Canonical text of the protocol, as runs are filed under it; `timing` of timing runs."""
        from trackmark.bench.protocols import TIMING

        return TIMING if self.timing else self._protocol.text

    @property
    def clocked(self) -> bool:
        """Whether runs depend on how long trackers take, so that they go one by one."""
        return self.timing or self._protocol.clocked

    @property
    def _protocol(self) -> "Protocol":
        from trackmark.bench.protocols import (
            protocol,  # brings numerics, which help texts have no need of
        )

        return protocol(self.protocol)

    def __post_init__(self) -> None:
        if not self.name or "/" in self.name or self.name.startswith((".", "_")):
            raise ExperimentError(f"{self.name!r} can't name a folder of results.")
        check_name(Path(self.name))
        for number in (self.repetitions, *self.repeated.values()):
            if number < 1:
                raise ExperimentError(f"{self.name}: repetitions is {number}; give 1 or more.")
        if not self.trackers or not self.sequences:
            raise ExperimentError(f"{self.name}: there must be a tracker and a sequence to run.")
        for named in (self.trackers, [source.text for source in self.sequences]):
            ((text, number),) = Counter(named).most_common(1)
            if number > 1:
                raise ExperimentError(f"{self.name}: {brief(text)} is named twice.")
        try:
            once = self.protocol == Experiment.protocol
            once = once or self._protocol.name == Experiment.protocol
        except ValueError as error:
            raise ExperimentError(f"{self.name}: {error}") from None
        if self.arrays and (self.timing or not once):
            raise ExperimentError(f"{self.name}: arrays are kept of runs in one pass alone.")
        if self.timing and not once:
            raise ExperimentError(
                f"{self.name}: timing runs are in one pass; leave out the protocol {self.protocol}."
            )


def experiment_names() -> list[str]:
    """Names of the experiments that come with trackmark."""
    return sorted(_files())


def _files() -> dict[str, Path]:
    """Files of the experiments that come with trackmark, by name."""
    files = [*FOLDER.glob("*.toml"), *PAPERS.glob("*/experiments/*.toml")]
    return {_name_of(file): file for file in files}


def _name_of(path: Path) -> str:
    """What a file's experiment is called."""
    folder = path.absolute().parent
    of_paper = folder.name == "experiments" and folder.parent.parent == PAPERS.absolute()
    return f"{folder.parent.name}-{path.stem}" if of_paper else path.stem


def read_experiment(name_or_path: str | Path) -> Experiment:
    """Read an experiment: one of `experiment_names()`, or a TOML file.

    Raises
    ------
    ExperimentError
        Naming the file and the key that is missing, unknown or of the wrong kind.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        files = _files()
        path = files.get(str(name_or_path), path)
        if path.suffix != ".toml":
            known = sorted(files)
            hint = close_match(str(name_or_path), known)
            raise ExperimentError(
                f"unknown experiment {str(name_or_path)!r}.{hint} "
                f"Known: {', '.join(known)}; or give a .toml file."
            )
    return _experiment(path, read_toml(path, ExperimentError))


def read_toml(path: Path, error: type[ValueError]) -> dict[str, Any]:
    """What a TOML file says; one that can't be read is told as this error, with its name."""
    try:
        return tomllib.loads(path.read_text("utf-8-sig"))  # editors of Windows begin it with a mark
    except OSError as reason:
        raise error(f"{path}: {reason.strerror}.") from None
    except ValueError as reason:  # also UnicodeDecodeError, and integers of over 4300 digits
        raise error(f"{path}: {reason}.") from None
    except RecursionError:
        raise error(f"{path}: lists or tables are nested too deeply.") from None


_KINDS: Mapping[str, type] = {
    "version": int,
    "title": str,
    "protocol": str,
    "repetitions": int,
    "timing": bool,
    "arrays": bool,
    "trackers": list,
    "sequences": list,
}


def _experiment(path: Path, table: Mapping[str, Any]) -> Experiment:
    for key, value in table.items():
        if key not in _KINDS:
            raise ExperimentError(f"{path}: unknown key {key!r}. Known: {', '.join(_KINDS)}.")
        if type(value) is not _KINDS[key]:
            raise ExperimentError(f"{path}: {key} must be of type {_KINDS[key].__name__}.")
    for key in ("version", "trackers", "sequences"):
        if key not in table:
            raise ExperimentError(f"{path}: the key {key!r} is missing.")
    if table["version"] != VERSION:
        raise ExperimentError(
            f"{path}: version {table['version']} is not the version {VERSION} that is known here."
        )
    for key in ("trackers", "sequences"):
        _check_count(path, key, table[key])
    entrants = list(_entrants(path, table["trackers"]))
    return Experiment(
        name=_name_of(path),
        title=table.get("title", _name_of(path)),
        trackers=tuple(text for text, _ in entrants),
        sequences=tuple(_sources(path, table["sequences"])),
        repeated={text: number for text, number in entrants if number is not None},
        repetitions=table.get("repetitions", 1),
        timing=table.get("timing", False),
        arrays=table.get("arrays", False),
        protocol=table.get("protocol", Experiment.protocol),
    )


def _check_count(path: Path, key: str, entries: Iterable[Any]) -> None:
    """Refuse more sweeps than anybody runs, before they are written out."""
    count = sum(
        math.prod(len(value) for value in entry.values() if isinstance(value, list))
        for entry in entries
        if isinstance(entry, dict)
    )
    if count > MOST_SWEPT:
        raise ExperimentError(
            f"{path}: {key} sweeps over {count} combinations; at most {MOST_SWEPT} make an "
            "experiment. Sweep over fewer values."
        )


def _entrants(path: Path, entries: Iterable[Any]) -> Iterable[tuple[str, int | None]]:
    """Trackers; a table's `repetitions` is no parameter but how often they are run."""
    for entry in entries:
        number = None
        if isinstance(entry, dict) and "repetitions" in entry:
            number = entry["repetitions"]
            if type(number) is not int:
                raise ExperimentError(f"{path}: trackers: {entry!r}: repetitions must be a number.")
            entry = {key: value for key, value in entry.items() if key != "repetitions"}
        for text in _texts(path, "trackers", [entry]):
            yield text, number


def _sources(path: Path, entries: Iterable[Any]) -> Iterable[SequenceSource]:
    """Sequences; a table's `truth` is no variant but the file of recorded data's truth."""
    for entry in entries:
        truth = None
        if isinstance(entry, dict) and "truth" in entry:
            truth = Path(str(entry["truth"]))
            entry = {key: value for key, value in entry.items() if key != "truth"}
        for text in _texts(path, "sequences", [entry]):
            yield SequenceSource(text, truth)


def _texts(path: Path, key: str, entries: Iterable[Any]) -> Iterable[str]:
    """Text forms of entries; a table with lists is swept over their product."""
    for entry in entries:
        if isinstance(entry, str):
            texts = [entry]
        elif isinstance(entry, dict) and isinstance(entry.get("name"), str | list):
            options = {"name": entry["name"], **entry}
            values = [value if isinstance(value, list) else [value] for value in options.values()]
            if not all(values):
                raise ExperimentError(f"{path}: {key}: {entry!r} sweeps over an empty list.")
            texts = [
                format_text(str(chosen[0]), dict(zip(list(options)[1:], chosen[1:], strict=True)))
                for chosen in product(*values)
            ]
        else:
            raise ExperimentError(
                f"{path}: {key}: {entry!r} is neither a text nor a table with a name."
            )
        yield from texts
