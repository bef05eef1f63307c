"""Trackers from outside the package, imported in a child process.

Importing a file can print, end the process, change the working directory or never return. A child
process therefore imports such files and writes the result as JSON. Trackers in processes of their
own (`bench.external`) are described by these processes.
"""

import json
import os
import subprocess
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import (
    TrackerSpec,
    TrackerVersions,
    parse_tracker,
    parse_trackers,
    split_text,
)
from trackmark.bench.external.definition import is_external, open_external
from trackmark.bench.external.plugin import close_idle_processes
from trackmark.bench.machine_errors import check_room, temporary_file
from trackmark.bench.process_tree import ProcessTree
from trackmark.trackers import Randomness, Tracker, TrackerError
from trackmark.trackers.base.catalogue import describe_plugin, is_outside
from trackmark.trackers.base.former_imports import warn_of_former_imports

_SECONDS = 300.0
"""Time limit of the child process [s]."""

_MAX_BYTES = 1 << 26  # maximum size of the child's output


def resolve_trackers(texts: Iterable[str]) -> dict[str, TrackerSpec]:
    """Return trackers by specification; a child process imports those outside the package.

    Raises `TrackerError`, which names the file, for an invalid tracker or a failed import.
    """
    texts = list(dict.fromkeys(texts))
    parts = {text: split_text(text) for text in texts}
    outside = {name: is_outside(name) for name in {name for name, _ in parts.values()}}
    imported = [text for text in texts if outside[parts[text][0]] and not is_external(*parts[text])]
    answers = _ask_child("parse", imported)
    try:
        built_in = parse_trackers(text for text in texts if text not in answers)
    finally:
        close_idle_processes()
    return {
        text: built_in[text] if text in built_in else _spec(text, answers[text]) for text in texts
    }


def describe_tracker(text: str) -> dict[str, Any]:
    """Describe a tracker as `trackers.describe` does, also one from outside the package.

    `text` is a name; only a tracker in a process of its own needs its options.
    """
    name, options = split_text(text)
    if is_external(name, options):
        try:
            external = open_external(name, options)
            values = external.parameters.model_dump()
            return describe_plugin(external.plugin, external.file, external.name, values)
        finally:
            close_idle_processes()
    return _ask_child("describe", [name])[name] if is_outside(name) else trackers.describe(name)


def _spec(text: str, answer: dict[str, Any]) -> TrackerSpec:
    """Return the tracker that the child described; its file is imported when it is created."""
    version = answer.pop("version")
    file = Path(answer.pop("file"))
    randomness = Randomness(answer.pop("randomness"))
    warn_of_former_imports(file)
    spec = TrackerSpec(**answer, randomness=randomness, make=partial(_make, text), file=file)
    vars(spec)["version"] = version  # sets the `cached_property`, which would import the file
    return spec


def _make(text: str, seed: np.random.SeedSequence) -> Tracker:
    return parse_tracker(text).make(seed)


def _ask_child(question: str, texts: list[str]) -> dict[str, Any]:
    """Return the child's results by specification; raise `TrackerError` if a tracker failed."""
    if not texts:
        return {}
    end, lines = _child(json.dumps([question, texts]))
    answers: dict[str, tuple[str, Any]] = {}
    with suppress(ValueError, TypeError):  # a tracker file can write to any descriptor
        for line in lines:
            text, error, answer = json.loads(line)
            answers[text] = error, answer
    for text in texts:
        error, _ = answers.get(text, (f"{text}: the import failed: {end}.", None))
        if error:
            raise TrackerError(error)
    return {text: answers[text][1] for text in texts}


def _child(request: str) -> tuple[str, list[bytes]]:
    """Run the child process; return how it ended, and the lines that it wrote."""
    with temporary_file() as answers:
        child = ProcessTree.run_module(
            "trackmark.bench.experiments.tracker_files",
            [answers.fileno()],
            stdin=subprocess.PIPE,
            # Output of a tracker file is discarded.
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[answers.fileno()],
        )
        process = child.process
        try:
            process.communicate(request.encode(), _SECONDS)
            end = f"its process ends with status {process.returncode}"
        except subprocess.TimeoutExpired:
            end = f"nothing happens for {_SECONDS:g} s"
        finally:
            child.end()
        answers.seek(0)
        lines = answers.read(_MAX_BYTES).splitlines()
        if process.returncode:
            check_room(answers)  # a full disk is no failure of the tracker file
        return end, lines


def main() -> None:
    """Run the child process: write a JSON line with text, error and result per specification."""
    with os.fdopen(int(sys.argv[1]), "w", encoding="ascii") as file:
        question, texts = json.load(sys.stdin)
        for line in answer_lines(question, texts):
            file.write(f"{line}\n")
            file.flush()
    os._exit(0)  # skips exit handlers and threads of imported files


def answer_lines(question: str, texts: Iterable[str]) -> Iterator[str]:
    """Yield the JSON lines that the child process writes."""
    answer = partial(_parse, {}) if question == "parse" else trackers.describe
    for text in texts:
        try:
            yield json.dumps([text, "", answer(text)], default=str)
        except TrackerError as error:
            yield json.dumps([text, str(error), None])
        except BaseException as error:  # noqa: BLE001  # a tracker class can raise anything
            message = traceback.format_exception_only(type(error), error)[-1].strip()
            yield json.dumps([text, f"{text}: its description raises {message}", None])


def _parse(versions: TrackerVersions, text: str) -> dict[str, Any]:
    spec = parse_trackers([text], versions)[text]
    json.dumps(spec.parameters)  # raises an exception for values that JSON cannot hold
    data = {field.name: getattr(spec, field.name) for field in fields(spec)}
    del data["make"]
    return data | {"version": spec.version}
