"""Check of the files that a command writes: they differ from its inputs and from one another."""

import os
from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from trackmark.bench.experiments.experiment import SequenceSpec


def check_outputs(outputs: Mapping[str, Path | None], inputs: Iterable[Path] = ()) -> None:
    """Raise `UsageError` if two outputs are one file, or if an output would replace an input.

    `outputs` has files by option. `inputs` are existing files and folders that the command reads; a
    new file in a folder is allowed. Devices such as `/dev/null` can be written twice.
    """
    files = {option: path for option, path in outputs.items() if path is not None}
    for (first, path), (second, other) in combinations(files.items(), 2):
        if _is_same_file(path, other):
            raise click.UsageError(
                f"{first} and {second} name the same file, {path}. Give two files."
            )
    for option, path in files.items():
        for source in inputs:
            is_inside = _real(source) in _real(path).parents and path.exists()
            if is_inside or _is_same_file(path, source):
                raise click.UsageError(
                    f"{option}: {path} is an input of this command and would be overwritten. "
                    "Give another file."
                )


def _is_same_file(first: Path, second: Path) -> bool:
    """Return whether two paths lead to one file, also through links; False for devices."""
    try:
        return first.samefile(second) and (first.is_file() or first.is_dir())
    except OSError:  # one does not exist, has a name that is too long, or is a loop of links
        return _real(first) == _real(second)


def _real(path: Path) -> Path:
    """Return the path without symbolic links; `Path.resolve` would raise for a loop of links."""
    return Path(os.path.realpath(path))


def input_files(trackers: Iterable[str], sequences: Iterable["SequenceSpec"]) -> list[Path]:
    """Return the files and folders that specifications of trackers and sequences name."""
    sources = list(sequences)
    # File, class and options of a tracker are separated by colons: a.py:Mine:net=model.onnx.
    fields = [field for spec in trackers for field in spec.split(":")]
    files = [Path(field.partition("=")[2] or field) for field in fields]
    files += [source.truth for source in sources if source.truth is not None]
    sequences_or_folders = [Path(source.spec.partition(":")[0]) for source in sources]
    return [
        *(path for path in files if path.is_file()),
        *(path for path in sequences_or_folders if path.exists()),
    ]
