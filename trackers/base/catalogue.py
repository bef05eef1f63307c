"""Trackers by name: found by their files, imported only when asked for."""

import ast
import contextlib
import importlib
import importlib.util
import inspect
import re
import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Annotated, Any, Literal, get_args, get_origin

import numpy as np

from trackmark.trackers.base.former_imports import allow_former_imports, warn_of_former_imports
from trackmark.trackers.base.interface import Randomness, Tracker, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters, TrackerError, unknown

FOLDER = Path(__file__).parents[1]
ENTRY_POINTS = "trackmark.trackers"
DEFAULT_PRESET = "recommended"
"""What a tracker's name alone means, unless its class has another `default_preset`."""


@dataclass(frozen=True)
class Specification:
    """A tracker with all its parameters settled, ready to be made with any seed.

    The options set it apart in labels: `preset` unless it is the default, then every parameter that
    differs from the preset's value, by name.
    """

    name: str  # without parameters; seeds depend on it
    preset: str  # that the parameters start from
    parameters: Parameters  # the values, frozen
    options: Mapping[str, Any]
    plugin: type[TrackerPlugin]
    file: Path  # where the class is defined

    @property
    def randomness(self) -> Randomness:
        """Where its random numbers come from."""
        return self.plugin.randomness

    def create(self, seed: int | np.random.SeedSequence = 0) -> Tracker:
        """Make the tracker; equal seeds give equal trackers."""
        if not isinstance(seed, np.random.SeedSequence):
            seed = np.random.SeedSequence(seed)
        return self.plugin(self.parameters, seed)


def names() -> list[str]:
    """Names of all trackers: files of this package, then those of installed third parties.

    Nothing is imported; a tracker whose optional dependency is missing is listed too.
    """
    own = sorted(_name(file) for file in FOLDER.glob("*.py") if file.stem != "__init__")
    return own + sorted({entry.name for entry in metadata.entry_points(group=ENTRY_POINTS)})


def create(name: str, seed: int | np.random.SeedSequence = 0, **parameters: Any) -> Tracker:
    """Make a tracker.

    Parameters
    ----------
    name : str
        One of `names()`, or `path/to/file.py:ClassName`, without the class where the file holds
        one tracker.
    seed : int or numpy.random.SeedSequence
        Same seed, same boxes.
    **parameters
        `preset`, and values that override the preset's; `as` is what a tracker in a file of
        its own is called instead.

    Raises
    ------
    TrackerError
        For an unknown name, preset or parameter, a value out of bounds, an optional dependency
        that is not installed, or a file that can't be imported.
    """
    return resolve(name, **parameters).create(seed)


def resolve(name: str, **parameters: Any) -> Specification:
    """Settle a tracker's parameters without making it; see `create`."""
    plugin, file = _load(name)
    label = name
    if in_file(name) is not None:
        label = _own_name(plugin, file, parameters.pop("as", ""))
    default = _default_preset(plugin)
    preset = str(parameters.pop("preset", default))
    presets = {DEFAULT_PRESET: {}, **plugin.presets}
    if preset not in presets:
        raise unknown(f"preset of {label}", preset, presets)
    fields = plugin.Parameters.model_fields
    values = presets[preset]
    settled = plugin.Parameters.checked(label, {**values, **parameters})
    # What has to be given has no value to differ from.
    given = {key for key, field in fields.items() if field.is_required() and key not in values}
    base = plugin.Parameters.checked(
        label, {**values, **{key: getattr(settled, key) for key in given}}
    )
    options: dict[str, Any] = {} if preset == default else {"preset": preset}
    for key in sorted(fields):
        if key in given or getattr(settled, key) != getattr(base, key):
            options[key] = getattr(settled, key)
    return Specification(label, preset, settled, options, plugin, file)


def describe(name: str) -> dict[str, Any]:
    """Say what a tracker is.

    `name`, `summary`, `paper`, `randomness`, `presets`, `default_preset` (which the name alone
    means), and `parameters`: a list of dicts with `name`, `type`, `default` (of that preset; empty
    for what has to be given) and `meaning` (unit in brackets).
    """
    plugin, file = _load(name)
    fields = plugin.Parameters.model_fields
    required = {key: "" for key, field in fields.items() if field.is_required()}
    if required:
        values: Mapping[str, Any] = {key: field.default for key, field in fields.items()} | required
    else:
        values = dict(resolve(name).parameters)
    return {
        "name": name if in_file(name) is None else _own_name(plugin, file, ""),
        "summary": inspect.cleandoc(plugin.__doc__ or ""),
        "paper": plugin.paper,
        "randomness": str(plugin.randomness),
        "presets": {DEFAULT_PRESET: {}, **{key: dict(v) for key, v in plugin.presets.items()}},
        "default_preset": _default_preset(plugin),
        "parameters": [
            {
                "name": key,
                "type": _type_text(field.annotation),
                "default": values[key],
                "meaning": field.description or "",
            }
            for key, field in fields.items()
        ],
    }


def summary(name: str) -> str:
    """First line of a tracker file's docstring, read without importing it."""
    file = FOLDER / f"{name.replace('-', '_')}.py"
    if not file.is_file():
        entries = metadata.entry_points(group=ENTRY_POINTS, name=name)
        return "; ".join(f"third party: {entry.value}" for entry in entries)
    return (ast.get_docstring(ast.parse(file.read_bytes())) or "").partition("\n")[0]


def in_file(name: str) -> tuple[Path, str] | None:
    """Return file and class (if any) of `path/to/file.py:ClassName`; None for other names."""
    found = re.fullmatch(r"(.*?\.py)(?::(.*))?", name, re.DOTALL)
    return (Path(found[1]).expanduser(), found[2] or "") if found else None


def is_outside(name: str) -> bool:
    """Whether a tracker is none of this package: importing it may do anything."""
    return in_file(name) is not None or bool(metadata.entry_points(group=ENTRY_POINTS, name=name))


def _default_preset(plugin: type[TrackerPlugin]) -> str:
    """Preset that a tracker's name alone means."""
    return str(getattr(plugin, "default_preset", DEFAULT_PRESET))


def _own_name(plugin: type[TrackerPlugin], file: Path, given: str) -> str:
    """What a tracker in a file is called: as asked for, as its class says, or by file and class."""
    name = given or plugin.name
    if not (isinstance(name, str) and name):  # a class may have a property of that name
        return f"{file.name}:{plugin.__name__}"
    if not re.fullmatch(r"\w[\w.-]*", name):
        raise TrackerError(
            f"{file}: a tracker can't be called {name!r}: letters, digits, _, - and ."
        )
    if name in names():
        raise TrackerError(f"{file}: {name!r} is another tracker's name; give as=NAME.")
    return name


def _name(file: Path) -> str:
    return file.stem.replace("_", "-")


def _type_text(annotation: Any) -> str:
    """A parameter's type as a reader would say it: `float`, `fixed | adaptive`, `float | rule`."""
    if get_origin(annotation) is Annotated:
        return _type_text(get_args(annotation)[0])
    if get_origin(annotation) is Literal:
        return " | ".join(str(value) for value in get_args(annotation))
    if get_args(annotation):
        return " | ".join(_type_text(part) for part in get_args(annotation))
    return getattr(annotation, "__name__", str(annotation))


@cache
def _load(name: str) -> tuple[type[TrackerPlugin], Path]:
    """Class and file of a tracker."""
    try:
        place = in_file(name)
        if place is not None:
            return _load_file(*place)
        file = FOLDER / f"{name.replace('-', '_')}.py"
        entries = tuple(metadata.entry_points(group=ENTRY_POINTS, name=name))
        own = name == _name(file) and file.is_file() and file.stem != "__init__"
        if own + len(entries) > 1:
            owners = ["trackmark"] * own + [entry.value for entry in entries]
            raise TrackerError(f"tracker {name!r} is offered more than once: {', '.join(owners)}.")
        if own:
            module = importlib.import_module(f"trackmark.trackers.{file.stem}")
            (exported,) = module.__all__
            return _checked(getattr(module, exported), name), file
        if entries:
            allow_former_imports()
            plugin = _checked(entries[0].load(), name)
            file = Path(str(sys.modules[plugin.__module__].__file__))
            warn_of_former_imports(file)
            return plugin, file
    except ImportError as error:
        raise TrackerError(f"tracker {name!r} can't be used here: {error}") from error
    except RuntimeError as error:
        if "no locator available" not in str(error):
            raise
        raise TrackerError(
            f"tracker {name!r} can't be used here: Numba finds no folder for compiled kernels that "
            "can be written. Set NUMBA_CACHE_DIR to such a folder."
        ) from error
    raise unknown("tracker", name, names())


class _SourceLoader(SourceFileLoader):
    """Loader that ignores cached bytecode, which misses an edit within a second of equal size."""

    def get_code(self, fullname: str) -> CodeType:
        """See `importlib.abc.InspectLoader`."""
        return self.source_to_code(self.get_data(self.path), self.path)


def _load_file(file: Path, class_name: str) -> tuple[type[TrackerPlugin], Path]:
    """Class from a file anywhere."""
    if not file.is_file():
        raise TrackerError(f"{file}: there is no such tracker file.")
    module_name, path = f"trackmark_plugin_{file.stem}", str(file.absolute())
    loader = _SourceLoader(module_name, path)
    spec = importlib.util.spec_from_file_location(module_name, path, loader=loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    allow_former_imports()
    try:
        with contextlib.chdir(Path.cwd()):  # paths are relative to it, whatever the file does
            loader.exec_module(module)
    except ImportError:
        raise
    except (Exception, SystemExit) as error:
        raise TrackerError(f"{file}: it can't be imported: {_said(error, path)}") from error
    class_name = class_name or _only_tracker(module, file)
    if not hasattr(module, class_name):
        classes = [key for key, value in vars(module).items() if isinstance(value, type)]
        raise unknown(f"class in {file}", class_name, classes)
    warn_of_former_imports(file.resolve())
    return _checked(getattr(module, class_name), f"{file.name}:{class_name}"), file.resolve()


def _said(error: BaseException, file: str) -> str:
    """What was raised, with the line of the file that it comes from, in one line."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == file]
    if isinstance(error, SyntaxError) and error.filename == file:
        lines = [error.lineno]
    where = f" (line {lines[0]})" if lines and lines[0] else ""
    # This guards against errors that can't even be printed; a syntax error's last line says it.
    said = traceback.format_exception_only(type(error), error)[-1]
    return " ".join(said.split())[:300] + where


def _only_tracker(module: ModuleType, file: Path) -> str:
    """Name of the class in a file that holds one tracker."""
    found = {
        key: value
        for key, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, TrackerPlugin)
        and value.__module__ == module.__name__
    }
    classes = [key for key in found if not inspect.isabstract(found[key])] or list(found)
    exported = [key for key in classes if key in getattr(module, "__all__", classes)]
    if len(exported) == 1:
        return exported[0]
    if not classes:
        raise TrackerError(f"{file}: it holds no class derived from trackers.TrackerPlugin.")
    raise TrackerError(f"{file}: it holds {', '.join(classes)}; say which: {file}:{classes[0]}.")


def _checked(plugin: Any, name: str) -> type[TrackerPlugin]:
    if not (isinstance(plugin, type) and issubclass(plugin, TrackerPlugin)):
        raise TrackerError(
            f"tracker {name!r}: {plugin!r} is not a class derived from trackers.TrackerPlugin."
        )
    presets: Any = plugin.presets
    if inspect.isabstract(plugin):
        lacking = ", ".join(sorted(plugin.__abstractmethods__))
        raise TrackerError(f"tracker {name!r}: it lacks {lacking}.")
    if not (
        isinstance(presets, Mapping)
        and all(isinstance(k, str) and isinstance(v, Mapping) for k, v in presets.items())
    ):
        raise TrackerError(f"tracker {name!r}: presets are parameter values by preset name.")
    if _default_preset(plugin) not in {DEFAULT_PRESET, *presets}:
        raise TrackerError(f"tracker {name!r}: default_preset is one of its presets.")
    if not isinstance(plugin.randomness, Randomness):
        raise TrackerError(f"tracker {name!r}: randomness is one of trackers.Randomness.")
    if not (isinstance(plugin.Parameters, type) and issubclass(plugin.Parameters, Parameters)):
        raise TrackerError(f"tracker {name!r}: Parameters derives from trackers.Parameters.")
    return plugin
