"""Check the installation: versions, caches and optional trackers."""

import importlib
import json
import os
import platform
import sys
from pathlib import Path
from typing import Any

import click

from trackmark.bench.commands import EXIT_NEGATIVE
from trackmark.bench.commands._options import Command, json_option
from trackmark.bench.package_version import package_version
from trackmark.datasets.source_digest import library_version, library_versions
from trackmark.reports.printable import wrap

LIBRARIES = ("numpy", "numba", "pandas", "matplotlib", "scipy", "av")
OPENCV = "cv2"
MISSING = "not installed"


@click.command("doctor", cls=Command)
@json_option
def command(as_json: bool) -> int:
    """Check the installation: versions, caches and optional trackers.

    For example:
      trackmark doctor --json

    Exit codes: 0 no problem; 1 at least one problem, which is printed with a remedy.
    """
    versions = _versions()
    findings: dict[str, Any] = {
        "environment": {
            "trackmark": package_version(),
            "python": f"{platform.python_version()} ({sys.executable})",
            "platform": platform.platform(),
            "cores": str(os.cpu_count()),
            "packages": str(Path(__file__).parents[2]),
        },
        "versions": versions,
        "caches": _caches(),
        "trackers": _trackers(),
        "problems": [
            *(f"{name} is {MISSING}." for name, version in versions.items() if version == MISSING),
            *_opencv_problems([*library_versions({OPENCV})]),
            *_data_problems(),
        ],
    }
    if as_json:
        click.echo(json.dumps(findings, indent=1))
    else:
        for heading, items in findings.items():
            click.echo(heading)
            if isinstance(items, list):
                lines = items or ["none"]
            else:
                width = max(len(key) for key in items)
                lines = [f"{key:{width}}  {value}" for key, value in items.items()]
            for line in lines:
                click.echo(wrap(f"  {line}"))
    return EXIT_NEGATIVE if findings["problems"] else 0


def _versions() -> dict[str, str]:
    """Return versions of libraries by distribution; of OpenCV, those of all distributions.

    A library without a distribution, as Conda can install it, has its import name.
    """
    versions: dict[str, str] = {}
    for name in (*LIBRARIES, OPENCV):
        versions |= library_versions({name}) or {name: library_version(name) or MISSING}
    return versions


def _caches() -> dict[str, str]:
    """Return paths and sizes of the caches."""
    from trackmark.datasets.file_digest import cache_folder

    folder = cache_folder()
    size = "does not exist yet"
    if folder.is_dir():
        files = [file for file in folder.rglob("*") if file.is_file()]
        size = f"{len(files)} files, {sum(file.stat().st_size for file in files) / 1e6:.1f} MB"
    try:
        folders = _kernel_folders()
        compiled = [file for folder in folders for file in folder.glob("*.nbi")]
        kernels = f"{len(compiled)} in {os.path.commonpath(folders)}"
    except (ImportError, RuntimeError) as error:
        kernels = f"not available ({error})"
    return {"file digests": f"{folder} ({size})", "compiled kernels": kernels}


def _kernel_folders() -> set[Path]:
    """Return the folders that Numba selects for the trackers' compiled kernels.

    Raises `RuntimeError` if Numba can write to no folder.
    """
    package = Path(__file__).parents[2] / "trackers"
    folders: set[Path] = set()
    for file in package.rglob("*.py"):
        if "@njit(cache=True" in file.read_text():
            module_names = file.relative_to(package.parents[1]).with_suffix("").parts
            for value in vars(importlib.import_module(".".join(module_names))).values():
                path = getattr(getattr(value, "stats", None), "cache_path", None)
                folders |= {Path(path)} if path else set()
    return folders


def _trackers() -> dict[str, str]:
    """Return for each tracker `ready`, options that it needs, or why it cannot be used."""
    from trackmark import trackers
    from trackmark.bench.experiments.tracker_spec import describe_tracker

    states = {}
    for name in trackers.names():
        try:
            parameters = describe_tracker(name)["parameters"]
            required = [f"{about['name']}=PATH" for about in parameters if about["default"] == ""]
            states[name] = f"needs {', '.join(required)}" if required else "ready"
        except (trackers.TrackerError, RuntimeError) as error:  # Numba raises RuntimeError
            states[name] = str(error)
    return states


def _opencv_problems(distributions: list[str]) -> list[str]:
    """Return a message if distributions of OpenCV have replaced one another's files.

    One with `contrib` in its name can be installed over one without, which trackmark depends on.
    """
    if len(distributions) < 2:
        return []
    install = "pip install --force-reinstall --no-deps"
    contributed = [name for name in distributions if "contrib" in name]
    if len(contributed) != 1 or len(distributions) > 2:
        return [
            f"{len(distributions)} distributions provide cv2: install exactly one. Run `pip "
            f"uninstall {' '.join(distributions)}` and `{install} opencv-python-headless`."
        ]
    from trackmark.trackers.base.opencv import find_factory

    try:
        find_factory("KCF")
    except ImportError:
        return [
            f"another distribution has replaced the files of {contributed[0]}. Run `{install} "
            f"{contributed[0]}`."
        ]
    return []


def _data_problems() -> list[str]:
    """Return messages on data that cannot be read and on caches that cannot be written."""
    from trackmark import datasets
    from trackmark.datasets.file_digest import cache_folder

    problems: list[str] = []
    try:
        datasets.load("samples/face")
    except datasets.SequenceError as error:
        problems.append(str(error))
    except Exception as error:  # noqa: BLE001  # a broken library can raise any exception
        problems.append(
            f"samples/face: reading fails ({type(error).__name__}: {error}). "
            "Install the versions of constraints.txt."
        )
    try:
        _kernel_folders()
    except ImportError as error:
        problems.append(f"{error}.")
    except RuntimeError as error:
        problems.append(f"{error}. Set NUMBA_CACHE_DIR to a folder that can be written.")
    folder = cache_folder()
    nearest = next(path for path in (folder, *folder.parents) if path.exists())
    if not os.access(nearest, os.W_OK):
        problems.append(f"{folder} cannot be written: file digests are computed every time.")
    return problems
