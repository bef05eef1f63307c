"""Trackers from outside the package, asked in a child process what they are.

Importing a file may do anything: print, end the process, change its folder, never come back. So the
command's own process imports none of others; what it needs to know of them comes back as JSON.
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
    PACKAGE,
    Contestant,
    KnownVersions,
    contestant,
    contestants,
    split_text,
)
from trackmark.bench.process_tree import Offspring
from trackmark.trackers import Randomness, Tracker, TrackerError
from trackmark.trackers.base.catalogue import in_file, is_outside
from trackmark.trackers.base.former_imports import warn_of_former_imports

_SECONDS = 300.0
"""In which all of them must be imported."""

_MOST_BYTES = 1 << 26  # of what is answered

# What is told of a tracker, and the type that JSON makes of it.
_KINDS: dict[str, type] = dict.fromkeys(("label", "name", "preset", "init", "class_name"), str)
_KINDS |= {"randomness": str, "file": str, "parameters": dict, "version": dict, "implied": list}


def settled(texts: Iterable[str]) -> dict[str, Contestant]:
    """Settle trackers by their text forms, as `contestants` does, those from outside in a child.

    Raises `TrackerError`: for what can't be imported, too, naming the file.
    """
    texts = list(dict.fromkeys(texts))
    names = {text: split_text(text)[0] for text in texts}
    outside = {name: is_outside(name) for name in set(names.values())}
    answers = _asked("settle", [text for text in texts if outside[names[text]]])
    own = contestants(text for text in texts if text not in answers)
    return {text: own[text] if text in own else _told(text, answers[text]) for text in texts}


def described(name: str) -> dict[str, Any]:
    """Say what a tracker is, as `trackers.describe` does; one from outside is asked in a child."""
    return _asked("describe", [name])[name] if is_outside(name) else trackers.describe(name)


def _told(text: str, answer: Any) -> Contestant:
    """The tracker that was described; it is imported here only if it is made here.

    Raises `TrackerError` for what the child can't have said: a file may write into any descriptor.
    """
    given: dict[str, Any] = answer if isinstance(answer, dict) else {}
    told: dict[str, Any] = {key: given.get(key) for key in _KINDS}
    known = all(type(value) is _KINDS[key] for key, value in told.items())
    if not known or told["randomness"] not in list(Randomness) or not _is_from(text, told["file"]):
        raise TrackerError(f"{text}: while it is imported, it answers for its process.")
    del told["version"]
    told["randomness"] = Randomness(told["randomness"])
    told["file"] = Path(told["file"])
    warn_of_former_imports(told["file"])
    told["make"] = partial(_make, text)
    chosen = Contestant(**told)
    vars(chosen)["version"] = answer["version"]  # where `cached_property` keeps it
    return chosen


def _is_from(text: str, file: str) -> bool:
    """Whether a tracker may be from this file: it must not pass for one of the package."""
    place = in_file(split_text(text)[0])
    return Path(file).parent != PACKAGE if place is None else Path(file) == place[0].resolve()


def _make(text: str, seed: np.random.SeedSequence) -> Tracker:
    return contestant(text).make(seed)


def _asked(question: str, texts: list[str]) -> dict[str, Any]:
    """What a child answers, by text.

    Raises `TrackerError` with what it says is wrong, or how it ended.
    """
    if not texts:
        return {}
    ended, lines = _child(json.dumps([question, texts]))
    told: dict[str, tuple[str, Any]] = {}
    with suppress(ValueError, TypeError):  # a file may write anywhere: what it spoils is no answer
        for line in lines:
            text, error, answer = json.loads(line)
            told[text] = error, answer
    for text in texts:
        error, _ = told.get(text, (f"{text}: while it is imported, {ended}.", None))
        if error:
            raise TrackerError(error)
    return {text: told[text][1] for text in texts}


def _child(request: str) -> tuple[str, list[bytes]]:
    """How the child ended, in words, and the lines that it wrote."""
    with tempfile.TemporaryFile() as written:
        child = Offspring(
            "trackmark.bench.experiments.tracker_files",
            [written.fileno()],
            stdin=subprocess.PIPE,
            # What a file prints is nobody's answer: its runs keep it where they fail.
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=[written.fileno()],
        )
        process = child.process
        try:
            process.communicate(request.encode(), _SECONDS)
            ended = f"its process ends with status {process.returncode}"
        except subprocess.TimeoutExpired:
            ended = f"nothing happens for {_SECONDS:g} s"
        finally:
            child.end()
        written.seek(0)
        return ended, written.read(_MOST_BYTES).splitlines()


def main() -> None:
    """Answer in the child: a line of text, error and answer for each text that is asked for."""
    with os.fdopen(int(sys.argv[1]), "w", encoding="ascii") as answers:
        question, texts = json.load(sys.stdin)
        for line in answered(question, texts):
            answers.write(f"{line}\n")
            answers.flush()
    os._exit(0)  # whatever a file wants to be done, or waits for, at the end


def answered(question: str, texts: Iterable[str]) -> Iterator[str]:
    """The lines, one by one."""
    answer = partial(_settle, {}) if question == "settle" else trackers.describe
    for text in texts:
        try:
            yield json.dumps([text, "", answer(text)], default=str)
        except TrackerError as error:
            yield json.dumps([text, str(error), None])
        except BaseException as error:  # noqa: BLE001  # whatever a tracker's class does
            said = traceback.format_exception_only(type(error), error)[-1].strip()
            yield json.dumps([text, f"{text}: it can't be asked what it is: {said}", None])


def _settle(known: KnownVersions, text: str) -> dict[str, Any]:
    chosen = contestants([text], known)[text]
    json.dumps(chosen.parameters)  # of which identities are made
    told = {field.name: getattr(chosen, field.name) for field in fields(chosen)}
    return told | {"make": None, "version": chosen.version}
