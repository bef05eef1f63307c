"""Trackers as arguments of functions: texts, classes, functions, objects, dicts and lists."""

import ast
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MethodType
from typing import Any
from weakref import WeakValueDictionary

import numpy as np

from trackmark import IMPORT_TIME
from trackmark.bench.experiments.tracker_spec import (
    TrackerSpec,
    parse_tracker,
    source_file,
    tracker_version,
)
from trackmark.bench.external.isolated import IsolatedFactory
from trackmark.trackers import Randomness, Tracker, TrackerError
from trackmark.trackers.base.catalogue import (
    check_name,
    names,
    resolve_plugin,
)
from trackmark.trackers.base.estimate_check import value_text
from trackmark.trackers.base.plain import PlainTracker, to_plugin
from trackmark.trackers.base.plain_class import missing_methods
from trackmark.trackers.base.tracker_files import PLUGIN_MODULE, validate_plugin


def resolve_trackers(trackers: Any, repetitions: int, base_seed: int | None) -> list[TrackerSpec]:
    """Return the trackers of an argument; see `evaluate`.

    Raises `TrackerError` for an invalid tracker or two different trackers with one name. Raises
    `TypeError` for an object that is not a tracker.
    """
    by_label: dict[str, tuple[Any, TrackerSpec]] = {}
    owners = _Owners()
    for name, tracker in _named(trackers):
        spec = _resolve(tracker, name, repetitions)
        if not isinstance(tracker, str | Path):
            if not isinstance(tracker, type) and not missing_methods(tracker):
                owners.add(tracker, spec.label, is_new=True)
            spec = replace(spec, make=partial(owners.create, spec))
        other, other_spec = by_label.setdefault(spec.label, (tracker, spec))
        if not _is_same(tracker, other) and not _equal_texts(spec, other_spec, tracker, other):
            raise TrackerError(
                f"two different trackers are called {spec.label!r}. Give them names by a dict: "
                f"{{'first': ..., 'second': ...}}."
            )
    if not by_label:
        raise TrackerError("no tracker is given. Give at least one.")
    return [replace(spec, base_seed=base_seed) for _, spec in by_label.values()]


class _Owners:
    """Labels of the trackers to which objects belong."""

    def __init__(self) -> None:
        self._labels: dict[int, str] = {}
        self._objects: WeakValueDictionary[int, Any] = WeakValueDictionary()

    def add(self, tracker: Any, label: str, *, is_new: bool = False) -> None:
        """Note the label of an object.

        A function can return one object for several runs of a tracker; if `is_new`, the object is
        an argument. Raises `TrackerError` if the object belongs to another tracker.
        """
        other = self._labels.get(id(tracker), "")
        is_same = self._objects.get(id(tracker)) is tracker
        if is_same and (is_new or other != label):
            raise TrackerError(
                f"trackers {other!r} and {label!r} are one object, whose runs would share its "
                "state. Give the class, or a new object for each."
            )
        with suppress(TypeError):  # a class with `__slots__`
            self._objects[id(tracker)] = tracker
            self._labels[id(tracker)] = label

    def create(self, spec: TrackerSpec, seed: np.random.SeedSequence) -> Tracker:
        """Create a tracker; raise `TrackerError` if it is the object of another tracker."""
        plugin = spec.make(seed)
        self.add(plugin.plain if isinstance(plugin, PlainTracker) else plugin, spec.label)
        return plugin


def _is_same(tracker: Any, other: Any) -> bool:
    """Return whether two arguments are one tracker; `==` of a user's object can do anything."""
    if isinstance(tracker, MethodType) and isinstance(other, MethodType):
        return tracker.__self__ is other.__self__ and tracker.__func__ is other.__func__
    return tracker is other or (isinstance(tracker, str | Path) and tracker == other)


def _equal_texts(spec: TrackerSpec, other_spec: TrackerSpec, *trackers: Any) -> bool:
    """Return whether two specifications select one tracker, for example by a default value."""
    is_text = all(isinstance(tracker, str | Path) for tracker in trackers)
    if is_text and len({*map(str, trackers)}) == 1:
        return True
    # Environment variables of a process are not part of its version.
    both = spec, other_spec
    in_environment = any(s.is_isolated and not isinstance(s.make, IsolatedFactory) for s in both)
    equal = spec.version == other_spec.version and spec.parameters == other_spec.parameters
    return is_text and not in_environment and equal


def tracker_specs(trackers: Any) -> tuple[str, ...]:
    """Return the trackers of an argument as specifications, which other processes can read.

    Raises `TrackerError` for other objects than texts and paths.
    """
    specs = []
    for name, tracker in _named(trackers):
        if name or not isinstance(tracker, str | Path):
            file = source_file(tracker) if isinstance(tracker, type) else None
            example = f"{file}:{tracker.__name__}" if file else "path/to/file.py:ClassName"
            raise TrackerError(
                f"{name or value_text(tracker)}: worker processes read trackers from files, and a "
                f"dict cannot name them. Give, for example, {example!r} (its import must start no "
                "runs), or use trackmark.evaluate."
            )
        specs.append(str(tracker))
    return tuple(specs)


def _named(trackers: Any) -> Iterator[tuple[str, Any]]:
    """Yield the name, empty for the default, and the object of each tracker in an argument."""
    if isinstance(trackers, Mapping):
        for name, tracker in trackers.items():
            if not isinstance(name, str):
                raise TypeError(f"the name {name!r} of a tracker is not a text.")
            if not name.isprintable() or not name.strip():
                raise TrackerError(
                    f"{name!r} is not a valid name of a tracker. Use printable text."
                )
            if name in names() and not (isinstance(tracker, str) and name == tracker):
                raise TrackerError(f"the name {name!r} belongs to another tracker. Choose another.")
            yield name, tracker
    elif isinstance(trackers, list | tuple):
        for tracker in trackers:
            yield from _named(tracker)
    else:
        yield "", trackers


def _resolve(tracker: Any, name: str, repetitions: int) -> TrackerSpec:
    if isinstance(tracker, str | Path):
        spec = parse_tracker(str(tracker))
        return replace(spec, label=name) if name else spec
    try:
        is_class, missing = isinstance(tracker, type), missing_methods(tracker)
    except ValueError as error:
        raise TrackerError(f"{value_text(tracker)} is not a tracker: {error}") from None
    if not is_class and missing and (len(missing) == 1 or not callable(tracker)):
        raise TypeError(
            f"{value_text(tracker)} is not a tracker: it lacks {', '.join(missing)}. Expected: a "
            "name, a file, a class with the methods init(image, box) and update(image), a function "
            "that creates such an object, or an object."
        )
    tracker_class = tracker if is_class or missing else type(tracker)
    own_name = getattr(tracker_class, "__name__", "tracker")
    if is_class:
        plugin = validate_plugin(tracker, name or own_name)
    else:
        if not missing and repetitions > 1:
            raise TrackerError(
                f"tracker {name or own_name!r} is an object, and repetitions is {repetitions}. "
                "Give the class, not an instance."
            )
        plugin = to_plugin(tracker if missing else lambda: tracker, name or own_name)
        plugin.__name__ = own_name
    declared = getattr(tracker_class, "name", "")
    declared = declared if isinstance(declared, str) else ""
    label = name or declared or own_name
    if declared:
        check_name(declared, f"tracker {own_name!r}")
    # Other objects can depend on values that no file contains.
    file = source_file(tracker) if is_class and "<locals>" not in tracker.__qualname__ else None
    if file is not None and not _defines(file, own_name):
        file = None
    specification = resolve_plugin(plugin, file or Path(), label, {})
    # As in a specification of the file: both get the same random numbers.
    spec_name = declared or (f"{file.name}:{own_name}" if file else own_name)
    return TrackerSpec(
        label=label,
        name=spec_name,
        preset=specification.preset,
        parameters=specification.parameters.model_dump(),
        randomness=Randomness(getattr(tracker_class, "randomness", plugin.randomness)),
        make=specification.create,
        file=file,
        version=tracker_version(spec_name, file, own_name),
    )


def _defines(file: Path, name: str) -> bool:
    """Return whether a Python file has exactly one statement `class NAME` at its top level."""
    statements = ast.parse(file.read_bytes()).body
    return [
        getattr(entry, "name", "") for entry in statements if isinstance(entry, ast.ClassDef)
    ].count(name) == 1


def unsaved_reason(spec: TrackerSpec) -> str:
    """Return the reason why runs of a tracker cannot be saved; empty if they can."""
    if spec.base_seed is not None:
        return f"was evaluated with seed={spec.base_seed}"
    if spec.file is None:
        return "has no source file that determines its boxes"
    # The version of a process is up to date, and trackmark imports an edited file again.
    for name, module in [] if spec.call_seconds else list(sys.modules.items()):
        file = Path(getattr(module, "__file__", None) or "")
        checked = spec.file.parent in file.parents and PLUGIN_MODULE not in name and file.is_file()
        if checked and file.stat().st_mtime > IMPORT_TIME:
            return f"uses {file}, which has changed since trackmark was imported"
    return ""
