"""Catalogue of trackers: names, parameters and creation; a tracker is imported on first use."""

import ast
import importlib
import importlib.util
import inspect
import re
import sys
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol, get_args, get_origin

import numpy as np

from trackmark.trackers.base.interface import Randomness, Tracker, TrackerPlugin
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    closest_match,
    unknown_name_error,
)

FOLDER = Path(__file__).parents[1]
ENTRY_POINTS = "trackmark.trackers"


class NamedSequence(Protocol):
    """Sequence with a name, on which seeds depend."""

    @property
    def name(self) -> str: ...  # noqa: D102  # canonical


@dataclass(frozen=True)
class Specification:
    """A tracker class with the values of all parameters.

    Attributes
    ----------
    name : str
        Name without parameters; random seeds depend on it.
    preset : str
        Preset that supplies the values of parameters that are not given.
    parameters : Parameters
        Values of all parameters.
    options : mapping of str to object
        Part of the tracker's label: `preset` unless it is the default, and every parameter that
        differs from the preset's value.
    plugin : type
        Class of the tracker.
    file : Path
        File that defines the class.
    """

    name: str
    preset: str
    parameters: Parameters
    options: Mapping[str, Any]
    plugin: type[TrackerPlugin]
    file: Path

    @property
    def randomness(self) -> Randomness:
        """Source of the tracker's random numbers."""
        return self.plugin.randomness

    def create(self, seed: int | np.random.SeedSequence = 0) -> Tracker:
        """Create the tracker; equal seeds give equal estimates."""
        if not isinstance(seed, np.random.SeedSequence):
            seed = np.random.SeedSequence(seed)
        return self.plugin(self.parameters, seed)


def names() -> list[str]:
    """Return the names of this package's trackers, then those of installed entry points.

    No tracker is imported, so trackers with a missing optional dependency are included.
    """
    package_names = sorted(
        _file_to_name(file) for file in FOLDER.glob("*.py") if file.stem != "__init__"
    )
    return package_names + sorted(
        {entry.name for entry in metadata.entry_points(group=ENTRY_POINTS)}
    )


def create(
    name: str,
    seed: int | np.random.SeedSequence | None = None,
    *,
    sequence: NamedSequence | None = None,
    repetition: int = 0,
    **parameters: Any,
) -> Tracker:
    """Create a tracker.

    Parameters
    ----------
    name : str
        One of `names()`, or `path/to/file.py:ClassName`, without parameters. The class may be
        omitted if the file defines only one tracker.
    seed : int or numpy.random.SeedSequence, optional
        Seed of the tracker's random numbers; equal seeds give equal boxes. The default is 0.
    sequence : Sequence, optional
        Sequence on which the tracker will run. The tracker then gets the seed of a run of
        `trackmark run` and `trackmark.evaluate`, and gives equal boxes. An integer `seed` is that
        of `evaluate`.
    repetition : int
        Repetition of this run, from 0; only with a sequence.
    **parameters
        `preset`, and values that override those of the preset. For a tracker in a file, `as` sets
        the name.

    Returns
    -------
    Tracker
        A new tracker; call `init` first.

    Raises
    ------
    TrackerError
        For an unknown name, preset or parameter, a value out of bounds or of another type, an
        optional dependency that is not installed, or a file that can't be imported.
    """
    if not isinstance(name, str):
        raise TrackerError(
            f"name is {name!r}. Expected: a text; to create a class, call the class."
        )
    if isinstance(sequence, str):
        raise TrackerError(f"sequence is {sequence!r}. Expected: trackmark.load_sequence(...).")
    if repetition and sequence is None:
        raise TrackerError(f"repetition is {repetition} without a sequence. Give both, or a seed.")
    specification = resolve(name, **parameters)
    if sequence is None:
        return specification.create(0 if seed is None else seed)
    if isinstance(seed, np.random.SeedSequence):
        raise TrackerError(
            "seed is a SeedSequence. With a sequence, seed must be an integer or None."
        )
    run = specification.name, sequence.name, repetition
    return specification.create(run_seed(*run, base=seed))


def run_seed(
    name: str, sequence: str, repetition: int, restarts: int = 0, base: int | None = None
) -> np.random.SeedSequence:
    """Return the seed of a run: it depends on tracker name, sequence name and repetition only.

    Trackers of equal name get the same random numbers. Other trackers have no influence. `restarts`
    is the number of trackers that the protocol has started earlier in the run. `base` selects other
    random numbers for all runs.
    """
    key = (zlib.crc32(name.encode()), zlib.crc32(sequence.encode()))
    entropy = repetition if base is None else [base, repetition]
    return np.random.SeedSequence(entropy, spawn_key=(*key, restarts) if restarts else key)


def resolve(name: str, **parameters: Any) -> Specification:
    """Return a tracker's class and parameter values without creating it; see `create`."""
    plugin, file = _load(name)
    if in_file(name) is None:
        return resolve_plugin(plugin, file, name, parameters)
    label = tracker_name(plugin, file, parameters.pop("as", ""))
    if "python" in parameters:
        raise TrackerError(
            f"{name}: trackers in other interpreters run by trackmark.evaluate, trackmark.run and "
            "`trackmark run` only. Omit python."
        )
    return resolve_plugin(plugin, file, label, parameters, ("as", "python"))


def resolve_plugin(
    plugin: type[TrackerPlugin],
    file: Path,
    label: str,
    parameters: Mapping[str, Any],
    option_names: Iterable[str] = (),
) -> Specification:
    """Return a class with the values of all parameters; `parameters` can contain `preset`.

    For a tracker without a base class, it can contain `images`. `option_names` are further valid
    names, for the error for an unknown parameter.
    """
    fields = plugin.Parameters.model_fields
    adapted: Any = plugin if hasattr(plugin, "with_images") else None  # see `plain`
    own_options = {"preset", "images"} if adapted else {"preset"}
    for name in parameters:
        if name not in {*fields, *own_options}:
            names = {*fields, *own_options, *option_names}
            raise unknown_name_error(f"parameter of {label}", name, names - {"preset"})
    parameters = dict(parameters)
    options: dict[str, Any] = {}
    if adapted:
        images = parameters.pop("images", adapted.images)
        if images != adapted.images:
            plugin, options = adapted.with_images(images, label), {"images": images}
    default = plugin.default_preset
    preset = str(parameters.pop("preset", default))
    presets = {TrackerPlugin.default_preset: {}, **plugin.presets}
    if preset not in presets:
        raise unknown_name_error(f"preset of {label}", preset, presets)
    values = presets[preset]
    settled = plugin.Parameters.checked(label, {**values, **parameters})
    # Required parameters have no default to compare with, so they are always options.
    required_names = {
        key for key, field in fields.items() if field.is_required() and key not in values
    }
    base = plugin.Parameters.checked(
        label, {**values, **{key: getattr(settled, key) for key in required_names}}
    )
    options |= {} if preset == default else {"preset": preset}
    for key in sorted(fields):
        if key in required_names or getattr(settled, key) != getattr(base, key):
            options[key] = getattr(settled, key)
    return Specification(label, preset, settled, options, plugin, file)


def describe(name: str) -> dict[str, Any]:
    """Return the description of a tracker.

    Its keys are `name`, `summary`, `paper`, `randomness`, `presets`, `default_preset`,
    `parameters` and `choices`. `presets` contains the values that differ from the default preset.
    `parameters` is a list of dicts with the keys `name`, `type`, `default`, `meaning`, `as_written`
    and `origin`. `default` is the value in the default preset; it is empty for a required
    parameter. `meaning` ends with the unit in brackets. `as_written` is the value in the preset
    `as-written`, and `origin` is the source of this value; it is empty if none is declared.
    `choices` is a list of dicts with the keys `name`, `value` and `reason`.
    """
    plugin, file = _load(name)
    return describe_plugin(
        plugin, file, name if in_file(name) is None else tracker_name(plugin, file, "")
    )


def describe_plugin(
    plugin: type[TrackerPlugin],
    file: Path,
    name: str,
    changed_defaults: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the description of a class; see `describe`."""
    fields = plugin.Parameters.model_fields
    required = {key: "" for key, field in fields.items() if field.is_required()}
    if changed_defaults is not None:
        values = changed_defaults
    elif required:
        values = {key: field.default for key, field in fields.items()} | required
    else:
        values = dict(resolve_plugin(plugin, file, name, {}).parameters)
    presets = _differences_from_default(plugin)
    origins = plugin.Parameters.origins()
    return {
        "name": name,
        "summary": inspect.cleandoc(plugin.__doc__ or ""),
        "paper": plugin.paper,
        "randomness": str(plugin.randomness),
        "presets": presets,
        "default_preset": plugin.default_preset,
        "parameters": [
            {
                "name": key,
                "type": _type_text(field.annotation),
                "default": values[key],
                "meaning": field.description or "",
                "as_written": presets.get("as-written", {}).get(key, values[key]),
                "origin": origins.get(key, ""),
            }
            for key, field in fields.items()
        ],
        "choices": [
            {"name": key, "value": value, "reason": reason}
            for key, (value, reason) in plugin.choices.items()
        ],
    }


def _differences_from_default(plugin: type[TrackerPlugin]) -> dict[str, dict[str, Any]]:
    """Return the values of each preset that differ from those of the default preset."""
    declared = {key: field.default for key, field in plugin.Parameters.model_fields.items()}
    presets = {
        preset: {**declared, **values}
        for preset, values in {TrackerPlugin.default_preset: {}, **plugin.presets}.items()
    }
    default = presets.get(plugin.default_preset, declared)
    return {
        preset: {key: value for key, value in values.items() if value != default[key]}
        for preset, values in presets.items()
    }


def summary(name: str) -> str:
    """Return the first line of a tracker file's docstring, without importing the file."""
    file = FOLDER / f"{name.replace('-', '_')}.py"
    if not file.is_file():
        entry_points = metadata.entry_points(group=ENTRY_POINTS, name=name)
        return "; ".join(f"third party: {entry.value}" for entry in entry_points)
    return (ast.get_docstring(ast.parse(file.read_bytes())) or "").partition("\n")[0]


def in_file(name: str) -> tuple[Path, str] | None:
    """Return file and class (empty if missing) of `file.py:ClassName`; None for other names."""
    match = re.fullmatch(r"(.*?\.py)(?::(.*))?", name, re.DOTALL)
    return (Path(match[1]).expanduser(), match[2] or "") if match else None


def is_outside(name: str) -> bool:
    """Return whether a tracker is not part of this package; importing it may run any code."""
    return in_file(name) is not None or bool(metadata.entry_points(group=ENTRY_POINTS, name=name))


def tracker_name(plugin: type[TrackerPlugin], file: Path, requested_name: str) -> str:
    """Return a tracker's name: the requested one, else its class attribute, else file and class."""
    name = requested_name or plugin.name
    if not (isinstance(name, str) and name):  # a class may define `name` as a property
        return f"{file.name}:{plugin.__name__}"
    check_name(name, str(file))
    return name


def check_name(name: str, owner: str) -> None:
    """Raise `TrackerError` if a tracker cannot have a name; `owner` is the tracker in messages."""
    if not re.fullmatch(r"\w[\w.-]*", name):
        raise TrackerError(
            f"{owner}: {name!r} is not a valid name of a tracker. Use letters, digits, '_', '-' "
            "and '.'."
        )
    if name in names():
        raise TrackerError(
            f"{owner}: the name {name!r} belongs to another tracker. Choose another one."
        )


def _file_to_name(file: Path) -> str:
    return file.stem.replace("_", "-")


def _type_text(annotation: Any) -> str:
    """Return a parameter's type as text: `float`, `fixed | adaptive`, `float | rule`."""
    if get_origin(annotation) is Annotated:
        return _type_text(get_args(annotation)[0])
    if get_origin(annotation) is Literal:
        return " | ".join(str(value) for value in get_args(annotation))
    if get_args(annotation):
        return " | ".join(_type_text(part) for part in get_args(annotation))
    return getattr(annotation, "__name__", str(annotation))


def _load(name: str) -> tuple[type[TrackerPlugin], Path]:
    """Return class and file of a tracker; a file is imported again after each edit."""
    file_and_class = in_file(name)
    if file_and_class is None or not file_and_class[0].is_file():
        return _import(name, "", b"")
    return _import(name, str(file_and_class[0].absolute()), file_and_class[0].read_bytes())


@cache
def _import(name: str, path: str, source: bytes) -> tuple[type[TrackerPlugin], Path]:
    """Return class and file of a tracker; see `_load`. `path` and `source`: keys of the cache."""
    try:
        file_and_class = in_file(name)
        if file_and_class is not None:
            # Trackers of the package do not need the modules that adapt and check other classes.
            from trackmark.trackers.base.tracker_files import load_file

            return load_file(*file_and_class)
        file = FOLDER / f"{name.replace('-', '_')}.py"
        entry_points = tuple(metadata.entry_points(group=ENTRY_POINTS, name=name))
        in_package = name == _file_to_name(file) and file.is_file() and file.stem != "__init__"
        if in_package + len(entry_points) > 1:
            owners = ["trackmark"] * in_package + [entry.value for entry in entry_points]
            raise TrackerError(
                f"tracker {name!r} is defined by several packages: {', '.join(owners)}. Uninstall "
                "all but one."
            )
        if in_package:
            module = importlib.import_module(f"trackmark.trackers.{file.stem}")
            (exported,) = module.__all__
            return getattr(module, exported), file
        if entry_points:
            from trackmark.trackers.base.tracker_files import validate_plugin

            plugin = validate_plugin(entry_points[0].load(), name)
            file = Path(str(sys.modules[plugin.__module__].__file__))
            return plugin, file
    except ImportError as error:
        raise TrackerError(f"tracker {name!r} cannot be used: {error}") from error
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
        raise TrackerError(
            f"tracker {name!r} cannot be used: Numba found no writable folder for compiled "
            "kernels. Set NUMBA_CACHE_DIR to a writable folder."
        ) from error
    start, colon, option = name.partition(":")
    if colon and start in names():
        raise TrackerError(f"{name!r}: {option!r} is no part of a name. Give options as arguments.")
    close = closest_match(name, names())
    hint = f"Did you mean {close!r}?" if close else "See `trackmark list trackers`."
    if name.endswith((".toml", ".ini")):
        hint = f"To use a tracker of this file, give {name}:NAME."
    raise TrackerError(f"unknown tracker {name!r}. {hint}")
