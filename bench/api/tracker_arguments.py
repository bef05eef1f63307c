"""Trackers as arguments of functions: texts, classes, functions, objects, dicts and lists."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from trackmark.bench.experiments.tracker_spec import TrackerSpec, parse_tracker, source_file
from trackmark.trackers import Randomness, Tracker, TrackerError
from trackmark.trackers.base.catalogue import DEFAULT_PRESET, validate_plugin
from trackmark.trackers.base.plain import to_plugin
from trackmark.trackers.base.plain_class import missing_methods


def resolve_trackers(trackers: Any, repetitions: int, base_seed: int | None) -> list[TrackerSpec]:
    """Return the trackers of an argument; see `evaluate`.

    Raises `TrackerError` for an invalid tracker or two different trackers with one name. Raises
    `TypeError` for an object that is not a tracker.
    """
    by_label: dict[str, tuple[Any, TrackerSpec]] = {}
    for name, tracker in _named(trackers):
        spec = _resolve(tracker, name)
        if repetitions > 1 and _is_instance(tracker):
            raise TrackerError(
                f"tracker {spec.label!r} is an object, and repetitions is {repetitions}. Give the "
                "class, not an instance."
            )
        other, other_spec = by_label.setdefault(spec.label, (tracker, spec))
        equal = isinstance(tracker, str) and spec.version == other_spec.version
        if other is not tracker and not equal:
            raise TrackerError(
                f"two different trackers are called {spec.label!r}. Give them names by a dict: "
                f"{{'first': ..., 'second': ...}}."
            )
    if not by_label:
        raise TrackerError("no tracker is given. Give at least one.")
    return [_with_base_seed(spec, base_seed) for _, spec in by_label.values()]


def tracker_texts(trackers: Any) -> tuple[str, ...]:
    """Return the trackers of an argument as specifications, which other processes can read.

    Raises `TrackerError` for other objects than texts and paths.
    """
    texts = []
    for name, tracker in _named(trackers):
        if name or not isinstance(tracker, str | Path):
            file = source_file(tracker) if callable(tracker) else None
            example = f"{file}:{tracker.__name__}" if file else "path/to/file.py:ClassName"
            raise TrackerError(
                f"{name or tracker!r}: worker processes read trackers from files. Give, for "
                f"example, {example!r} (its import must start no runs), or use "
                "trackmark.evaluate."
            )
        texts.append(str(tracker))
    return tuple(texts)


def _named(trackers: Any) -> Iterator[tuple[str, Any]]:
    """Yield the name, empty for the default, and the object of each tracker in an argument."""
    if isinstance(trackers, Mapping):
        yield from trackers.items()
    elif isinstance(trackers, list | tuple):
        for tracker in trackers:
            yield from _named(tracker)
    else:
        yield "", trackers


def _is_instance(tracker: Any) -> bool:
    """Return whether an object is a tracker that was already created."""
    return not isinstance(tracker, type) and not missing_methods(tracker)


def _resolve(tracker: Any, name: str) -> TrackerSpec:
    if isinstance(tracker, str | Path):
        spec = parse_tracker(str(tracker))
        return replace(spec, label=name) if name else spec
    if not callable(tracker) and not _is_instance(tracker):
        raise TypeError(
            f"{tracker!r} is not a tracker. Expected: a name, a file, a class with the methods "
            "init(image, box) and update(image), a function that creates such an object, or an "
            "object."
        )
    kind = type(tracker) if _is_instance(tracker) else tracker
    own_name = getattr(kind, "__name__", "tracker")
    if isinstance(tracker, type):
        plugin = validate_plugin(tracker, name or own_name)
    else:
        plugin = to_plugin(_same(tracker) if _is_instance(tracker) else tracker, name or own_name)
    declared = plugin.name if isinstance(plugin.name, str) else ""
    label = name or declared or own_name
    preset = str(getattr(plugin, "default_preset", DEFAULT_PRESET))
    parameters = plugin.Parameters.checked(label, plugin.presets.get(preset, {}))
    # Other objects can depend on values that no file contains.
    determined = isinstance(tracker, type) and "<locals>" not in tracker.__qualname__
    return TrackerSpec(
        label=label,
        name=label,
        preset=preset,
        parameters=parameters.model_dump(),
        randomness=plugin.randomness,
        make=lambda seed: plugin(parameters, seed),
        file=source_file(tracker) if determined else None,
        class_name=own_name,
    )


def _same(tracker: Any) -> Callable[[], Any]:
    """Return a function that returns the tracker, with the attributes of its class."""

    def same() -> Any:
        return tracker

    kind = type(tracker)
    same.__name__, same.__qualname__, same.__doc__ = kind.__name__, kind.__qualname__, kind.__doc__
    vars(same).update(
        name=getattr(kind, "name", ""), randomness=getattr(kind, "randomness", Randomness.NONE)
    )
    return same


def _with_base_seed(spec: TrackerSpec, base: int | None) -> TrackerSpec:
    """Return a tracker whose random numbers also depend on `base`; see `run_seed`."""
    if base is None:
        return spec

    def make(seed: np.random.SeedSequence) -> Tracker:
        entropy = [base, cast(int, seed.entropy)]
        return spec.make(np.random.SeedSequence(entropy, spawn_key=seed.spawn_key))

    return replace(spec, make=make)
