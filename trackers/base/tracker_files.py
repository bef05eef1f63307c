"""Trackers from outside the package: import of their files, and checks of their classes."""

import contextlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Mapping
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import Any

from trackmark.trackers.base.global_generators import GlobalGenerators, preserved_generators
from trackmark.trackers.base.interface import Randomness, TrackerPlugin
from trackmark.trackers.base.parameters import Parameters, TrackerError
from trackmark.trackers.base.plain import AdaptedTracker, to_plugin
from trackmark.trackers.base.plain_class import tracker_class

PLUGIN_MODULE = "trackmark_plugin_"
"""Start of the names of modules that are tracker files outside the package."""


class _SourceLoader(SourceFileLoader):
    """Loader that always compiles the source: cached bytecode can be older than a recent edit."""

    def get_code(self, fullname: str) -> CodeType:
        """See `importlib.abc.InspectLoader`."""
        return self.source_to_code(self.get_data(self.path), self.path)


def load_file(file: Path, class_name: str) -> tuple[type[TrackerPlugin], Path]:
    """Return the class and the resolved path of a tracker in a file outside the package."""
    if not file.is_file():
        raise TrackerError(f"{file}: this tracker file does not exist.")
    module_name, path = f"{PLUGIN_MODULE}{file.stem}", str(file.absolute())
    loader = _SourceLoader(module_name, path)
    spec = importlib.util.spec_from_file_location(module_name, path, loader=loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    if (folder := str(file.absolute().parent)) not in sys.path:
        sys.path.append(folder)  # for modules next to the file, also those that a run imports
    arguments = sys.argv
    try:
        # The file may change the working directory, and draw from the global generators.
        directory, generators = contextlib.chdir(Path.cwd()), GlobalGenerators(0)
        with directory, preserved_generators(), generators:
            sys.argv = [path]  # those of the process are not for the file
            loader.exec_module(module)
    except (Exception, SystemExit) as error:
        hint = ""
        if isinstance(error, SystemExit):
            hint = (
                ". The file ends the process when it is imported, for example because it parses "
                "arguments. Put this below if __name__ == '__main__':"
            )
        if isinstance(error, ModuleNotFoundError):
            hint = (
                ". If another Python environment has this module: --trackers FILE:python=PATH "
                "(docs/external.md)"
            )
        raise TrackerError(
            f"{file}: the file cannot be imported: {_error_text(error, path)}{hint}"
        ) from error
    finally:
        sys.argv = arguments
    try:
        loaded_class = tracker_class(module, class_name)
    except ValueError as error:
        raise TrackerError(f"{file}: {error}") from None
    return validate_plugin(loaded_class, f"{file.name}:{loaded_class.__name__}"), file.resolve()


def _error_text(error: BaseException, file: str) -> str:
    """Return an exception as one line of text, with the line number in the file."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == file]
    if isinstance(error, SyntaxError) and error.filename == file:
        lines = [error.lineno]
    where = f" (line {lines[0]})" if lines and lines[0] else ""
    # format_exception_only also handles exceptions whose `__str__` fails.
    message = traceback.format_exception_only(type(error), error)[-1]
    return " ".join(message.split())[:300] + where


def validate_plugin(plugin: Any, name: str) -> type[TrackerPlugin]:
    """Return the plugin class of a tracker class; raise `TrackerError` if the class is invalid.

    `name`: name of the tracker in messages.
    """
    if not isinstance(plugin, type):
        raise TrackerError(f"tracker {name!r}: {plugin!r} is not a class.")
    if not issubclass(plugin, TrackerPlugin):
        return to_plugin(plugin, name)
    declares_images = isinstance(getattr(plugin, "images", None), str)
    if declares_images and not issubclass(plugin, AdaptedTracker):
        raise TrackerError(
            f"tracker {name!r}: its class attribute images applies to classes without a base "
            "class. Omit it, and convert the BGR images in init and update."
        )
    presets: Any = plugin.presets
    if inspect.isabstract(plugin):
        missing_methods = ", ".join(sorted(plugin.__abstractmethods__))
        raise TrackerError(f"tracker {name!r}: it lacks {missing_methods}.")
    if not (
        isinstance(presets, Mapping)
        and all(isinstance(k, str) and isinstance(v, Mapping) for k, v in presets.items())
    ):
        raise TrackerError(
            f"tracker {name!r}: `presets` must be a dict of parameter values by preset name."
        )
    if plugin.default_preset not in {TrackerPlugin.default_preset, *presets}:
        raise TrackerError(
            f"tracker {name!r}: `default_preset` must be the name of one of its presets."
        )
    if not isinstance(plugin.randomness, Randomness):
        raise TrackerError(
            f"tracker {name!r}: `randomness` must be a member of trackers.Randomness."
        )
    if not (isinstance(plugin.Parameters, type) and issubclass(plugin.Parameters, Parameters)):
        raise TrackerError(
            f"tracker {name!r}: `Parameters` must be a class derived from trackers.Parameters."
        )
    return plugin
