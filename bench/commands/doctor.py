"""Check this installation: versions, caches, what optional trackers need."""

import importlib
import json
import os
import platform
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import click

from trackmark.bench.commands._options import json_option
from trackmark.reports.printable import wrapped

LIBRARIES = ("numpy", "numba", "pandas", "matplotlib", "av", "scikit-video")
OPENCV = "opencv"
MISSING = "not installed"


@click.command("doctor")
@json_option
def command(as_json: bool) -> int:
    """Check this installation; exit status 1 where something is wrong."""
    about: dict[str, Any] = {
        "environment": _environment(),
        "versions": _versions(),
        "caches": _caches(),
        "trackers": _trackers(),
        "problems": _library_problems() + _data_problems(),
    }
    if as_json:
        click.echo(json.dumps(about, indent=1))
    else:
        for heading, items in about.items():
            click.echo(heading)
            if isinstance(items, list):
                for item in items or ["none"]:
                    click.echo(wrapped(f"  {item}"))
                continue
            width = max(len(key) for key in items)
            for key, value in items.items():
                click.echo(wrapped(f"  {key:{width}}  {value}"))
    return 1 if about["problems"] else 0


def _environment() -> dict[str, str]:
    return {
        "trackmark": metadata.version("trackmark"),
        "python": f"{platform.python_version()} ({sys.executable})",
        "platform": platform.platform(),
        "cores": str(os.cpu_count()),
        "packages": str(Path(__file__).parents[2]),
    }


def _versions() -> dict[str, str]:
    opencv = sorted(
        str(found.metadata["Name"])
        for found in metadata.distributions()
        if str(found.metadata["Name"]).startswith(OPENCV)
    )
    return {name: _version(name) for name in (*LIBRARIES, *opencv)}


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return MISSING


def _caches() -> dict[str, str]:
    from trackmark.datasets.file_digest import cache_folder

    own = cache_folder()
    return {"file digests": f"{own} ({_size(own)})", "compiled kernels": _compiled_kernels()}


def _compiled_kernels() -> str:
    try:
        folders = _kernel_folders()
    except (ImportError, RuntimeError) as error:
        return f"not available ({error})"
    compiled = [file for folder in folders for file in folder.glob("*.nbi")]
    return f"{len(compiled)} in {os.path.commonpath(folders)}"


def _kernel_folders() -> set[Path]:
    """Return the folders that Numba selects for the trackers' compiled kernels.

    Raises `RuntimeError` if Numba can write to no folder.
    """
    package = Path(__file__).parents[2] / "trackers"
    folders: set[Path] = set()
    for file in package.rglob("*.py"):
        if "@njit(cache=True" in file.read_text():
            parts = file.relative_to(package.parents[1]).with_suffix("").parts
            for value in vars(importlib.import_module(".".join(parts))).values():
                path = getattr(getattr(value, "stats", None), "cache_path", None)
                folders |= {Path(path)} if path else set()
    return folders


def _size(folder: Path) -> str:
    if not folder.is_dir():
        return "not there yet"
    files = [file for file in folder.rglob("*") if file.is_file()]
    return f"{len(files)} files, {sum(file.stat().st_size for file in files) / 1e6:.1f} MB"


def _trackers() -> dict[str, str]:
    from trackmark import trackers
    from trackmark.bench.experiments.tracker_files import described

    def state(name: str) -> str:
        try:
            described(name)
        except (trackers.TrackerError, RuntimeError) as error:  # the latter is Numba's
            return str(error)
        return "ready"

    return {name: state(name) for name in trackers.names()}


def _library_problems() -> list[str]:
    """Return messages on libraries that are missing or installed twice."""
    versions = _versions()
    problems = [f"{name} is {MISSING}." for name, version in versions.items() if version == MISSING]
    opencv = [name for name in versions if name.startswith(OPENCV)]
    if len(opencv) != 1:
        problems.append(
            f"{len(opencv)} distributions provide cv2 ({', '.join(opencv)}): install exactly one."
        )
    return problems


def _data_problems() -> list[str]:
    """Return messages on data that cannot be read and on caches that cannot be written."""
    from trackmark import datasets
    from trackmark.datasets.file_digest import cache_folder

    problems: list[str] = []
    try:
        datasets.load("samples/face")
    except datasets.SequenceError as error:
        problems.append(str(error))
    except Exception as error:  # noqa: BLE001  # any defect of a library shows in its first use
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
        problems.append(f"{folder} can't be written: file digests are computed anew every time.")
    return problems
