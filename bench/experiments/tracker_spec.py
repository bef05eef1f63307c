"""Specifications of trackers: creation, version and identity of runs."""

import hashlib
import inspect
import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias, cast

import numpy as np

from trackmark import trackers
from trackmark.bench.external import FRAME_SECONDS, close_idle_processes, is_external, split_table
from trackmark.bench.protocols import ONE_PASS
from trackmark.datasets.interface import UnusableSequencesError
from trackmark.datasets.source_digest import library_versions, source_digest
from trackmark.datasets.spec_string import format_text, parse_text
from trackmark.datasets.versioning import find_version
from trackmark.trackers import Randomness, Tracker, TrackerError, TrackerPlugin
from trackmark.trackers.base.catalogue import (
    Specification,
    describe_plugin,
    in_file,
    is_outside,
)

TrackerFactory: TypeAlias = Callable[[np.random.SeedSequence], Tracker]

PACKAGE = Path(str(trackers.__file__)).parent
GOLDEN = PACKAGE / "golden.json"
"""File with the versions of the trackers; see `datasets.versioning`."""

BOXES = "boxes"
"""Name of the ground-truth boxes, which initialise runs by default."""

IMPORTED = "results of others"
"""Value of `source` in the `tracker_code` of imported runs."""


@dataclass(frozen=True)
class Identity:
    """Properties that determine a run: runs with equal identities have equal boxes."""

    tracker: str  # canonical specification: name, preset unless default, changed parameters
    tracker_name: str  # name without parameters; the seed depends on it
    preset: str  # name of the preset, also if it is the default
    parameters: Mapping[str, Any]  # all parameters, also those with default values
    # `source` (sealed version, or digest of the syntax trees of the tracker's file and of the
    # shared modules it imports) and `libraries` (version by distribution).
    tracker_code: Mapping[str, Any]
    sequence: str
    fingerprint: str
    repetition: int
    protocol: str  # `bench.protocols.EvaluationProtocol.key`, or `timing`
    init: str = "boxes"  # ground truth of initialisation and scores: `boxes` or a region's name

    @property
    def imported(self) -> bool:
        """True if the run was imported from a result file of another toolkit."""
        return bool(self.tracker_code.get("source") == IMPORTED)

    @cached_property
    def version(self) -> str:
        """Digest of all fields except the repetition; runs of equal version can be averaged."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        del values["repetition"]
        return _digest(values)

    @cached_property
    def tracker_version(self) -> str:
        """Digest of the tracker's source and libraries.

        The files of imported results do not count: each sequence has its own.
        """
        version = dict(self.tracker_code)
        if self.imported:
            version.pop("files", None)
        return _digest(version)


def _digest(determining: Mapping[str, Any]) -> str:
    """Return 16 hexadecimal digits of the SHA-256 digest of JSON values."""
    text = json.dumps(determining, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class TrackerSpec:
    """Tracker with validated parameters."""

    label: str  # canonical specification without defaults; `init` comes last
    name: str  # name without parameters
    preset: str  # as in `Identity`
    parameters: Mapping[str, Any]
    randomness: Randomness  # source of the tracker's random numbers
    make: TrackerFactory  # creates a tracker from a seed sequence
    file: Path | None  # source file; None for a callable without a file
    version: Mapping[str, Any]  # versions of source and libraries; see `Identity.tracker_code`
    init: str = BOXES  # as in `Identity`
    # Time limit of a call, which the tracker's own process enforces [s]; 0 without such a process.
    call_seconds: float = 0.0
    base_seed: int | None = None  # selects other random numbers for all runs; see `run_seed`

    @property
    def is_built_in(self) -> bool:
        """True for a tracker of the package: it keeps the state of the process."""
        return self.file is not None and self.file.parent == PACKAGE

    @property
    def is_isolated(self) -> bool:
        """True if the tracker runs in a process of its own."""
        return self.call_seconds > 0

    def isolated(self, frame_seconds: float) -> "TrackerSpec":
        """Return the tracker in a process of its own, with a time limit of each call [s].

        Trackers in other environments have such a process already, with limits of their own.
        """
        # A command loads the modules of processes only for a tracker that needs a process.
        from trackmark.bench.external.isolated import IsolatedFactory

        make = self.make
        if self.is_isolated and not isinstance(make, IsolatedFactory):
            return self
        if not isinstance(make, IsolatedFactory):
            name, options = split_text(self.label)
            options.pop("init", None)
            make = IsolatedFactory(name, options)
        make = replace(make, frame_seconds=frame_seconds)
        return replace(self, make=make, call_seconds=frame_seconds)

    @property
    def digest(self) -> str:
        """Digest of the version, as `Identity.tracker_version`."""
        return _digest(self.version)


def tracker_version(name: str, file: Path | None, class_name: str = "") -> dict[str, Any]:
    """Compute the version of a tracker from its source file; see `Identity.tracker_code`."""
    if file is None:
        return {"source": "unknown", "libraries": {}}
    source, libraries = source_digest(file, PACKAGE)
    seal = find_version(name, GOLDEN) if file.parent == PACKAGE else None
    if seal is not None:
        source = "-".join(map(str, seal.identity(source)))
        libraries = library_versions(set(seal.libraries))
    source = f"{source}-{class_name}" if class_name else source
    return {"source": source, "libraries": libraries}


def built_in_digest(name: str) -> str | None:
    """Return a tracker's current `Identity.tracker_version`; None if it is outside the package.

    The tracker is not imported.
    """
    file = PACKAGE / f"{name.replace('-', '_')}.py"
    return _digest(tracker_version(name, file)) if file.is_file() else None


def parse_tracker(tracker: str | TrackerFactory) -> TrackerSpec:
    """Return a tracker from its specification, or from a callable that creates the tracker.

    `tracker` is `name:key=value:…` or `path/to/file.py:ClassName:key=value:…`, or a callable that
    takes a `numpy.random.SeedSequence`. The class can be omitted if the file defines one tracker.
    In addition to parameters, keys can be `preset`, `init` and, for files, `as`.

    Raises `TrackerError` for an unknown name, preset or parameter, or a malformed text. Raises
    `TypeError` for a tracker object, because its seed is unknown.
    """
    if not isinstance(tracker, str):
        return _from_callable(tracker)
    name, options = split_text(tracker)
    # The initialisation is a choice of the harness, not a parameter of the tracker.
    init = options.pop("init", BOXES)
    if is_external(name, options) or is_outside(name):
        return _from_outside(name, options, init)
    specification = trackers.resolve(name, **options)
    version = tracker_version(name, specification.file)
    values = specification.parameters.model_dump()
    spec = _make_spec(specification, values, init, make=specification.create, version=version)
    uses_process = specification.randomness is Randomness.PROCESS
    return spec.isolated(FRAME_SECONDS) if uses_process else spec


def _from_callable(tracker: TrackerFactory) -> TrackerSpec:
    if not callable(tracker):
        raise TypeError(
            f"{type(tracker).__name__} is a tracker object, whose seed is unknown. Use its name, "
            "or a callable that creates the tracker from a numpy.random.SeedSequence."
        )
    name, file = getattr(tracker, "__qualname__", type(tracker).__qualname__), source_file(tracker)
    return TrackerSpec(
        label=name,
        name=name,
        preset="",
        parameters={},
        randomness=getattr(tracker, "randomness", Randomness.GENERATOR),
        make=tracker,
        file=file,
        version=tracker_version(name, file),
    )


def source_file(tracker: TrackerFactory) -> Path | None:
    """Return the file that defines a class or function; None if there is none."""
    try:
        source = inspect.getsourcefile(inspect.unwrap(tracker))
    except (TypeError, OSError):  # for example a functools.partial
        return None
    return Path(source) if source and Path(source).is_file() else None


def run_identity(
    spec: TrackerSpec, sequence: Any, repetition: int, protocol: str = ONE_PASS
) -> Identity:
    """Return the identity of a run; `sequence` has a name and a fingerprint."""
    return Identity(
        tracker=spec.label,
        tracker_name=spec.name,
        preset=spec.preset,
        parameters=spec.parameters,
        tracker_code=spec.version,
        sequence=sequence.name,
        fingerprint=sequence.fingerprint,
        repetition=repetition,
        protocol=protocol,
        init=spec.init,
    )


def _from_outside(name: str, options: dict[str, str], init: str) -> TrackerSpec:
    """Return a tracker that is not part of the package; its process is started once."""
    # A command loads the modules of processes only for a tracker that needs a process.
    from trackmark.bench.external.definition import open_external
    from trackmark.bench.external.isolated import open_isolated
    from trackmark.bench.external.plugin import ExternalPlugin

    if is_external(name, options):
        specification = open_external(name, options)
        plugin = cast(type[ExternalPlugin], specification.plugin)
        limits = plugin.external_options.start_limit, plugin.external_options.frame_limit
        return _make_spec(
            specification,
            specification.parameters.model_dump(),
            init,
            make=specification.create,
            call_seconds=max(limits),
            version=plugin.version,
        )
    factory, fields = open_isolated(name, options)
    # A file that defines one tracker can omit the class from the name.
    class_name = fields.pop("class_name")
    is_named = in_file(name) is None or fields["name"].endswith(f".py:{class_name}")
    file = Path(fields["file"])
    version = tracker_version(fields["name"], file, "" if is_named else class_name)
    selected = SimpleNamespace(**fields)
    spec = _make_spec(selected, selected.parameters, init, make=factory, version=version)
    return spec.isolated(FRAME_SECONDS)


def _make_spec(
    selected: Specification | SimpleNamespace,
    parameters: Mapping[str, Any],
    init: str,
    **fields: Any,
) -> TrackerSpec:
    """Return the tracker that a specification has selected, here or in another process."""
    init_option = {} if init == BOXES else {"init": init}
    return TrackerSpec(
        label=format_text(selected.name, {**selected.options, **init_option}),
        name=selected.name,
        preset=selected.options.get("preset", TrackerPlugin.default_preset),
        parameters=parameters,
        randomness=Randomness(selected.randomness),
        file=Path(selected.file),
        init=init,
        **fields,
    )


class UnusableTrackersError(TrackerError):
    """Error for all trackers of a command that cannot be used, and for its unusable sequences.

    If there are other trackers, the message says how to go on without these. `remedy` is this
    sentence, and `problem` the message without it.

    Parameters
    ----------
    errors : mapping of str to TrackerError
        Errors by specification.
    usable : collection of str
        Specifications of the other trackers.
    sequences : UnusableSequencesError, optional
        Error for the sequences of the command.
    """

    def __init__(
        self,
        errors: Mapping[str, TrackerError],
        usable: Collection[str],
        sequences: UnusableSequencesError | None = None,
    ) -> None:
        self.errors, self.usable, self.sequences = errors, usable, sequences
        lines = [*map(str, errors.values())]
        remedies = []
        if len(errors) + len(usable) > 1:
            lines.insert(
                0, f"{len(errors)} of {len(errors) + len(usable)} trackers cannot be used."
            )
        if usable:
            remedies.append(f"To go on without them, name only these trackers: {','.join(usable)}")
        if sequences:
            lines.append(sequences.problem)
            remedies.append(sequences.remedy)
        self.problem, self.remedy = "\n".join(lines), "\n".join(filter(None, remedies))
        super().__init__("\n".join(filter(None, (self.problem, self.remedy))))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.errors, self.usable, self.sequences)


def resolve_specs(specs: Iterable[str]) -> dict[str, TrackerSpec]:
    """Return trackers by their specifications, for use in other processes than this one.

    Files of trackers are imported in processes of their own, which end before this returns.

    Raises one `UnusableTrackersError` that names all trackers that cannot be used, and the others.
    """
    specs = list(dict.fromkeys(specs))
    parsed: dict[str, TrackerSpec] = {}
    errors: dict[str, TrackerError] = {}
    try:
        for spec in specs:
            try:
                parsed[spec] = parse_tracker(spec)
            except TrackerError as error:
                errors[spec] = error
    finally:
        close_idle_processes()
    if not errors:
        return parsed
    raise UnusableTrackersError(errors, list(parsed))


def describe_tracker(spec: str) -> dict[str, Any]:
    """Describe a tracker as `trackers.describe` does, also one from outside the package.

    `spec` is a name; only a tracker in another environment needs its options.
    """
    from trackmark.bench.external.definition import open_external
    from trackmark.bench.external.isolated import describe_isolated

    name, options = split_text(spec)
    try:
        if is_external(name, options):
            external = open_external(name, options)
            values = external.parameters.model_dump()
            return describe_plugin(external.plugin, external.file, external.name, values)
        return describe_isolated(name) if is_outside(name) else trackers.describe(name)
    finally:
        close_idle_processes()


def split_text(spec: str) -> tuple[str, dict[str, str]]:
    """Return name (or file and class) and options of a specification.

    Raises `TrackerError` for a malformed text.
    """
    speaks_trax = spec.strip().startswith("trax:")  # its command can name a file
    table = None if speaks_trax else split_table(spec.strip())
    file_and_class: tuple[Path | str, str] | None = table
    if not (table or speaks_trax):
        file_and_class = in_file(spec.strip())
    file, rest = file_and_class or ("", spec)
    if file_and_class and table is None and "=" in rest.partition(":")[0]:  # an option, not a class
        rest = f":{rest}"
    try:
        name, options = parse_text(rest)
    except ValueError as error:
        hint = " A command with ':' needs a table of a TOML file." if speaks_trax else ""
        raise TrackerError(f"tracker {error}{hint}") from None
    return (f"{file}:{name}" if name else str(file)) if file_and_class else name, options
