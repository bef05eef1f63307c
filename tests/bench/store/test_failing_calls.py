"""Every system call of the store fails once, or from then on: old or new, one line, no litter."""

import errno
import os
import shutil
from itertools import count

import pytest

from trackmark.bench.store.files import ResultsError

ERRORS = ("ENOSPC", "EIO", "EACCES", "EROFS", "EINTR")


class Obstacle:
    """Lets a system call fail, or that one and all after it; see `store_calls`.

    Parameters
    ----------
    at : int
        Which call, counted from 0; those before it succeed.
    code : str
        Name of the error.
    lasting : bool
        Whether later calls fail too.
    """

    def __init__(self, at, code, lasting):
        self._at, self._code, self._lasting = at, getattr(errno, code), lasting
        self._numbers = count()
        self.failed = []

    def __call__(self, name, call, *arguments, **options):
        number = next(self._numbers)
        if number < self._at or (number > self._at and not self._lasting):
            return call(*arguments, **options)
        self.failed.append(name)
        if name == "close":  # it is closed all the same
            call(*arguments)
        raise OSError(self._code, os.strerror(self._code))


def number_of_calls(store_calls, scenario, folder):
    numbers = count()

    def around(name, call, *arguments, **options):
        next(numbers)
        return call(*arguments, **options)

    with store_calls(around):
        for step in scenario.steps(folder):
            step()
    return next(numbers)


@pytest.fixture
def failures(scenarios, snapshot, listing, old_or_new, store_calls, scratch):
    """Do a scenario again and again, with each of its calls failing in turn.

    `chosen` picks what is tried, from all (call, error, whether it lasts). Gives the number of
    tries, what was said, calls whose errors came through as they are, and what is left when
    the scenario was done again without obstacle.
    """

    def tried(name, chosen):
        scenario, before, whole = scenarios[name], scratch / "before", scratch / "whole"
        scenario.before(before)
        shutil.copytree(before, whole)
        old = snapshot(before)
        number = number_of_calls(store_calls, scenario, whole)
        new, files = snapshot(whole), listing(whole)
        said, litter, raw = [], set(), set()
        tries = [(i, e, lasts) for i in range(number) for e in ERRORS for lasts in (False, True)]
        tries = [what for what in tries if chosen(*what)]
        for what in tries:
            folder = scratch / "folder"
            shutil.copytree(before, folder)
            obstacle = Obstacle(*what)
            try:
                with store_calls(obstacle):
                    for step in scenario.steps(folder):
                        step()
            except ResultsError as error:
                said.append((obstacle.failed[0], str(error)))
            except OSError:
                raw.add(obstacle.failed[-1])
            assert obstacle.failed, "no such call was made"
            old_or_new(snapshot(folder), old, new)
            for step in scenario.steps(folder):
                step()
            assert snapshot(folder) == new, what
            litter |= set(listing(folder)).symmetric_difference(files)
            shutil.rmtree(folder)
        return len(tries), said, raw, litter

    return tried


NAMES = ["first runs", "a stale run", "a stale run that had companions", "removal"]


def a_few(number, code, lasts):
    """Each call with one error, which lasts for every other call."""
    return code == ERRORS[number % len(ERRORS)] and lasts == number % 2


def check(name, failures, evidence, chosen):
    tries, said, raw, litter = failures(name, chosen)
    evidence(f"{name}: {tries} of {tries} failing system calls left old or new")
    assert tries > 40
    assert len(said) > 10
    assert raw == set()
    for call, message in said:
        assert "trial" in message, (call, message)
        assert "\n" not in message, (call, message)
    assert litter == set()


@pytest.mark.parametrize("name", ["first runs", "removal"])
def test_a_failing_call_leaves_old_or_new_and_can_be_made_again(failures, evidence, name):
    check(name, failures, evidence, a_few)


@pytest.mark.weekly
@pytest.mark.parametrize("name", NAMES)
def test_any_error_of_any_call_leaves_old_or_new(failures, evidence, name):
    check(name, failures, evidence, lambda *_: True)
