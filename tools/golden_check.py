"""Golden check of scenes and trackers: shows that changed sources have unchanged output.

`python -m tools.golden_check` (`make seal`) renders the scenes and runs the
trackers whose syntax trees differ from the recorded ones. If the output has the golden digests, it
records the new tree. Otherwise, it reports the difference and keeps the record. `--new NAME` gives
the scene or tracker a new version, so that stored runs of the old version are stale. See
`trackmark.datasets.versioning`.
"""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import click
from numpy.lib.introspect import opt_func_info

from tools.golden_digests import golden_digests
from trackmark import datasets, trackers
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.experiments.tracker_spec import GOLDEN, PACKAGE
from trackmark.bench.output_files import write_file
from trackmark.datasets.catalogue import suites
from trackmark.datasets.interface import stored_metadata
from trackmark.datasets.source_digest import imported_libraries, tree_digest
from trackmark.datasets.synthetic.suite import SyntheticSuite
from trackmark.datasets.versioning import VersionEntry, read_versions, write_versions

Golden = dict[str, Mapping[str, str]]

SHORT = (("samples/face", 0, 12), ("wang2010/table-tennis", 5, 16), ("moreno2005/octopus", 0, 5))
"""Sequences and their frames (from, to) on which trackers are checked: a recorded face, an occluded
ball, and a mask. They are few, because some trackers take a second per frame."""


@dataclass(frozen=True)
class GoldenEntry:
    """Scene or tracker that has a recorded version, or needs one."""

    name: str  # key in the `golden.json`
    file: Path  # the `golden.json`
    tree: str  # current digest of the syntax trees
    recorded: VersionEntry | None  # recorded version in the file; None if missing
    texts: list[str]  # keys of the golden digests
    digests: Callable[[str], dict[str, str]]  # current golden digests of a text
    libraries: list[str]  # import names of the libraries of a tracker; empty for scenes
    described: list[str]  # sequences of a scene whose metadata are recorded


def golden_entries() -> Iterator[GoldenEntry]:
    """Yield all scenes and trackers that can be checked on this machine."""
    yield from _scenes()
    yield from _trackers()


def golden_boxes(key: str) -> dict[str, str]:
    """Return the digest of the estimates in `TRACKER on SEQUENCE`, by instruction set."""
    text, _, name = key.partition(" on ")
    run = evaluate_run(text, _short(name))
    if run.failure:
        return {"failure": run.failure.partition(":")[0]}
    digest = hashlib.sha256()
    for values in (run.boxes, run.visible, run.confidence, run.revised):
        digest.update(b"none" if values is None else values.tobytes())
    return {instruction_set(): digest.hexdigest()[:32]}


def instruction_set() -> str:
    """Return the instruction set of NumPy's exponential function, such as `X86_V4`.

    NumPy computes it by other instructions on processors with AVX-512. The last digits differ, and
    particle filters amplify the difference. Boxes therefore have a digest per instruction set.
    """
    (signature,) = opt_func_info(func_name="^exp$", signature="float64")["exp"].values()
    return str(signature["current"]).removeprefix("baseline(").removesuffix(")")


@cache
def _short(name: str) -> datasets.Sequence:
    first, last = next((first, last) for short_name, first, last in SHORT if short_name == name)
    sequence = datasets.load(name)[first:last]
    sequence.frames = [sequence.frames[frame] for frame in range(len(sequence))]
    return sequence


def _scenes() -> Iterator[GoldenEntry]:
    for suite in suites():
        if not isinstance(suite, SyntheticSuite):
            continue
        recorded_entries = read_versions(suite.golden)
        covered: dict[str, list[str]] = {}
        for name in suite.names():
            key = next((key for key in recorded_entries if fnmatchcase(name, key)), name)
            covered.setdefault(key, []).append(name)
        for key, described in covered.items():
            name, recorded = described[0], recorded_entries.get(key)
            yield GoldenEntry(
                key,
                suite.golden,
                suite.tree(name),
                recorded,
                texts=[name, f"{name}:scene=1"] if recorded is None else list(recorded.golden),
                digests=lambda text: golden_digests(datasets.load(text)),
                libraries=[],
                described=described,
            )


def _trackers() -> Iterator[GoldenEntry]:
    recorded_entries = read_versions(GOLDEN)
    for name in trackers.names():
        try:
            specification = trackers.resolve(name)
        except trackers.TrackerError:  # not available on this machine
            continue
        if specification.file.parent != PACKAGE:
            continue
        tree = tree_digest(specification.file, PACKAGE)
        libraries = imported_libraries(specification.file, PACKAGE)
        about = trackers.describe(name)
        plain = about["default_preset"]
        texts = [name if key == plain else f"{name}:preset={key}" for key in about["presets"]]
        keys = [f"{text} on {sequence}" for text in texts for sequence, _, _ in SHORT]
        yield GoldenEntry(
            name, GOLDEN, tree, recorded_entries.get(name), keys, golden_boxes, libraries, []
        )


def _check(item: GoldenEntry, new: bool) -> str:
    """Check a scene or tracker and record its version; return a message, empty if unchanged."""
    recorded = item.recorded
    if (
        recorded is not None
        and recorded.tree == item.tree
        and set(recorded.golden) == set(item.texts)
        and set(recorded.metadata) == set(item.described)
        and not _lacks_instruction_set(recorded)
    ):
        return ""
    golden: Golden = {text: item.digests(text) for text in item.texts}
    metadata = {name: stored_metadata(datasets.load(name)) for name in item.described}
    if recorded is None:
        entry, message = (
            VersionEntry([1], item.tree, golden, item.libraries, metadata),
            "sealed for the first time",
        )
    else:
        if recorded.tree != item.tree and _lacks_instruction_set(recorded) and not new:
            return (
                f"NOT sealed: its golden digests are of processors without {instruction_set()}. "
                "Run `make seal` on the unchanged source on this machine first."
            )
        common = [text for text in golden if text in recorded.golden]
        different = [text for text in common if not _agree(golden[text], recorded.golden[text])]
        if different and not new:
            return (
                f"NOT sealed: the output changed for {', '.join(different)}. If that is intended, "
                f"use --new {item.name} for a new version."
            )
        entry = replace(recorded, tree=item.tree, golden=golden, metadata=metadata)
        message = "equal output: sealed again"
        if different:
            entry = replace(entry, version=recorded.next_version(), libraries=item.libraries)
            message = f"now version {entry.version[0]}"
        else:  # keep the digests of other processors
            entry = replace(
                entry,
                golden={text: {**recorded.golden.get(text, {}), **golden[text]} for text in golden},
            )
    recorded_entries = {**read_versions(item.file), item.name: entry}
    write_file(item.file, lambda file: write_versions(file, recorded_entries))
    return message


def _lacks_instruction_set(recorded: VersionEntry) -> bool:
    """Return whether a tracker has no golden digests of this processor."""
    is_tracker = any(" on " in text for text in recorded.golden)
    return is_tracker and not any(instruction_set() in parts for parts in recorded.golden.values())


def _agree(digests: Mapping[str, str], golden: Mapping[str, str]) -> bool:
    """Return whether digests are equal.

    `look` is not compared, as it only describes images, nor are boxes of other processors.
    """
    common = digests.keys() & golden.keys() - {"look"}
    return all(digests[part] == golden[part] for part in common)


@click.command("seal")
@click.option(
    "--new",
    multiple=True,
    metavar="NAME",
    help="scene or tracker that gets a new version if its output changed",
)
@click.option("--only", default="", metavar="PREFIX", help="check only names with this prefix")
def main(new: tuple[str, ...], only: str) -> None:
    """Check scenes and trackers whose source changed, and record their versions."""
    refused = 0
    for item in golden_entries():
        if item.name.startswith(only) and (message := _check(item, item.name in new)):
            refused += message.startswith("NOT")
            click.echo(f"{item.name}: {message}")
    raise SystemExit(1 if refused else 0)


if __name__ == "__main__":
    main()
