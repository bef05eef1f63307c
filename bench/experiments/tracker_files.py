"""Trackers from outside the package, imported in a child process.

Importing a file may print, end the process, change its folder or never return. The command's own
process therefore imports none: a child writes what is needed as JSON.
"""

import json
import os
import subprocess
import sys
import tempfile
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
    KnownVersions,
    TrackerSpec,
    parse_tracker,
    parse_trackers,
    split_text,
)
from trackmark.bench.process_tree import ProcessTree
from trackmark.trackers import Randomness, Tracker, TrackerError
from trackmark.trackers.base.catalogue import is_outside
from trackmark.trackers.base.former_imports import warn_of_former_imports

_SECONDS = 300.0
"""Time limit of the child [s]."""

_MAX_BYTES = 1 << 26  # of the child's answer


def resolve_trackers(texts: Iterable[str]) -> dict[str, TrackerSpec]:
    """Return trackers by their specifications, as `parse_trackers` does; outside ones from a child.

    Raises `TrackerError`, which names the file, also for a file that cannot be imported.
    """
    texts = list(dict.fromkeys(texts))
    names = {text: split_text(text)[0] for text in texts}
    outside = {name: is_outside(name) for name in set(names.values())}
    answers = _ask_child("settle", [text for text in texts if outside[names[text]]])
    own = parse_trackers(text for text in texts if text not in answers)
    return {text: own[text] if text in own else _spec(text, answers[text]) for text in texts}


def describe_tracker(name: str) -> dict[str, Any]:
    """Return the description of a tracker, as `trackers.describe` does; see `resolve_trackers`."""
    return _ask_child("describe", [name])[name] if is_outside(name) else trackers.describe(name)


def _spec(text: str, answer: dict[str, Any]) -> TrackerSpec:
    """Return the tracker of a child's answer; it is imported here only when it is created."""
    version = answer.pop("version")
    file = Path(answer.pop("file"))
    randomness = Randomness(answer.pop("randomness"))
    warn_of_former_imports(file)
    spec = TrackerSpec(**answer, randomness=randomness, make=partial(_make, text), file=file)
    vars(spec)["version"] = version  # where `cached_property` keeps it
    return spec


def _make(text: str, seed: np.random.SeedSequence) -> Tracker:
    return parse_tracker(text).make(seed)


def _ask_child(question: str, texts: list[str]) -> dict[str, Any]:
    """Return the child's answers by text; raise `TrackerError` with its error or how it ended."""
    if not texts:
        return {}
    end, lines = _child(json.dumps([question, texts]))
    answers: dict[str, tuple[str, Any]] = {}
    with suppress(ValueError, TypeError):  # a file may write into the child's descriptors
        for line in lines:
            text, error, answer = json.loads(line)
            answers[text] = error, answer
    for text in texts:
        error, _ = answers.get(text, (f"{text}: while it is imported, {end}.", None))
        if error:
            raise TrackerError(error)
    return {text: answers[text][1] for text in texts}


def _child(request: str) -> tuple[str, list[bytes]]:
    """Run the child; return how it ended and the lines that it wrote."""
    with tempfile.TemporaryFile() as answers:
        child = ProcessTree(
            "trackmark.bench.experiments.tracker_files",
            [answers.fileno()],
            stdin=subprocess.PIPE,
            # Output of a file is dropped: its runs store it if they fail.
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
        return end, answers.read(_MAX_BYTES).splitlines()


def main() -> None:
    """Write the child's answers: a line with text, error and answer for each text."""
    with os.fdopen(int(sys.argv[1]), "w", encoding="ascii") as file:
        question, texts = json.load(sys.stdin)
        for line in answer_lines(question, texts):
            file.write(f"{line}\n")
            file.flush()
    os._exit(0)  # skips exit handlers and threads of imported files


def answer_lines(question: str, texts: Iterable[str]) -> Iterator[str]:
    """Yield the lines of the child."""
    answer = partial(_settle, {}) if question == "settle" else trackers.describe
    for text in texts:
        try:
            yield json.dumps([text, "", answer(text)], default=str)
        except TrackerError as error:
            yield json.dumps([text, str(error), None])
        except BaseException as error:  # noqa: BLE001  # of any code in a tracker's class
            message = traceback.format_exception_only(type(error), error)[-1].strip()
            yield json.dumps([text, f"{text}: its description raises {message}", None])


def _settle(known: KnownVersions, text: str) -> dict[str, Any]:
    spec = parse_trackers([text], known)[text]
    json.dumps(spec.parameters)  # raises for values that an identity cannot hold
    data = {field.name: getattr(spec, field.name) for field in fields(spec)}
    del data["make"]
    return data | {"version": spec.version}
