"""Every state that a crash can leave on a disk is old or new, and is gone on from.

The store's system calls are recorded and replayed, call by call, on a model of a disk that
forgets what was not forced to it: names of files, whole contents, or half of them.
"""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from trackmark.bench.store.files import ResultsError, is_abandoned, temporary_name


@dataclass(eq=False)
class File:
    """Contents as written, and as they were when they were last forced to the disk."""

    content: bytes = b""
    synced: bytes = b""
    changed: int = 0

    def after_crash(self, loss):
        """What may stand in it."""
        if self.content == self.synced or loss == "nothing":
            return self.content
        return self.synced if loss == "contents" else self.content[: len(self.content) // 2]


@dataclass(eq=False)
class Folder:
    """Names as forced to the disk, and the changes since then, each of which gets there or not."""

    synced: dict = field(default_factory=dict)
    pending: list = field(default_factory=list)

    @property
    def names(self):
        """What a living process sees."""
        return self.after_crash(self.pending)

    def after_crash(self, survivors):
        """Names when only these of the pending changes got through."""
        names = dict(self.synced)
        for change in self.pending:
            if any(change is survivor for survivor in survivors):
                names |= change
        return {name: node for name, node in names.items() if node is not None}


class Disk:
    """Replays system calls below a folder.

    Parameters
    ----------
    root : Path
        The folder; what lies in it is on the disk already.
    heedless : type, optional
        `File` or `Folder`: what is not forced to the disk even when that is asked.
    """

    def __init__(self, root, heedless=None):
        self.root, self.heedless = root, heedless
        self.top = self._loaded(root)
        self._open = {}

    def _loaded(self, path):
        if path.is_dir():
            return Folder({child.name: self._loaded(child) for child in path.iterdir()})
        return File(path.read_bytes(), path.read_bytes(), path.stat().st_mtime_ns)

    def apply(self, name, *arguments):
        """Do a call that was recorded."""
        getattr(self, f"_{name}_call")(*arguments)

    def states(self):
        """Every content of the disk after a crash now, as files and folders by path.

        A file is its bytes and its time of change, a folder is None.
        """
        pending = [change for folder in self._folders(self.top) for change in folder.pending]
        for chosen in range(2 ** len(pending)):
            survivors = [change for i, change in enumerate(pending) if chosen >> i & 1]
            for loss in ("nothing", "contents", "half"):
                yield dict(self._tree(self.top, Path(), survivors, loss))

    def _tree(self, folder, path, survivors, loss):
        for name, node in folder.after_crash(survivors).items():
            if isinstance(node, File):
                yield path / name, (node.after_crash(loss), node.changed)
            else:
                yield path / name, None
                yield from self._tree(node, path / name, survivors, loss)

    def _folders(self, folder):
        yield folder
        for node in folder.names.values():
            if isinstance(node, Folder):
                yield from self._folders(node)

    def _place(self, path):
        """The folder of a path, and the name in it."""
        folder = self.top
        *parents, name = Path(path).relative_to(self.root).parts
        for parent in parents:
            folder = folder.names[parent]
        return folder, name

    def _open_call(self, descriptor, path, flags):
        if Path(path) == self.root:
            self._open[descriptor] = self.top
            return
        folder, name = self._place(path)
        if name not in folder.names:
            assert flags & os.O_CREAT
            folder.pending.append({name: File()})
        node = self._open[descriptor] = folder.names[name]
        if flags & os.O_TRUNC:
            node.content = b""

    def _write_call(self, descriptor, content, changed):
        self._open[descriptor].content += content
        self._open[descriptor].changed = changed

    def _ftruncate_call(self, descriptor, size):
        self._open[descriptor].content = self._open[descriptor].content[:size]

    def _fsync_call(self, descriptor):
        node = self._open[descriptor]
        if isinstance(node, self.heedless or ()):
            return
        if isinstance(node, File):
            node.synced = node.content
        else:
            node.synced, node.pending = node.names, []

    def _close_call(self, descriptor):
        del self._open[descriptor]

    def _link_call(self, source, target):
        folder, name = self._place(target)
        origin, old = self._place(source)
        folder.pending.append({name: origin.names[old]})

    def _replace_call(self, source, target):
        origin, old = self._place(source)
        folder, name = self._place(target)
        assert folder is origin, "a rename between folders is not one change"
        folder.pending.append({name: origin.names[old], old: None})

    def _unlink_call(self, path):
        folder, name = self._place(path)
        folder.pending.append({name: None})

    _rmdir_call = _unlink_call

    def _mkdir_call(self, path):
        folder, name = self._place(path)
        folder.pending.append({name: Folder()})


@pytest.fixture
def record(store_calls):
    """Do the steps of a scenario and give the calls that succeeded.

    Before the first step and after each stands what `observe` sees then, as the call `done`.
    """

    def recorded(steps, observe):
        journal = []

        def around(name, call, *arguments, **options):
            result = call(*arguments, **options)
            if name == "open":
                journal.append((name, result, *arguments[:2]))
            elif name == "write":
                changed = os.fstat(arguments[0]).st_mtime_ns
                journal.append((name, arguments[0], bytes(arguments[1])[:result], changed))
            elif name != "flock":  # a lock is on no disk
                journal.append((name, *arguments[:2]))
            return result

        with store_calls(around):
            journal.append(("done", observe()))
            for step in steps:
                step()
                journal.append(("done", observe()))
        return journal

    return recorded


def lay_down(state, folder):
    """Make files of a state."""
    folder.mkdir()
    for path, file in state.items():
        if file is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(file[0])
            os.utime(folder / path, ns=(file[1], file[1]))


@pytest.fixture
def checked_states(snapshot, listing, old_or_new, store_calls, scratch):
    """Check every state that a crash during a journal can leave.

    Give how many were met, how many of them differ, and what a command that goes on leaves.
    """

    def check(scenario, disk, journal, whole):
        goal, files = snapshot(whole), listing(whole)
        moments = [None, *(entry[1] for entry in journal if entry[0] == "done")]
        met, seen, litter = 0, set(), set()
        for entry in journal:
            if entry[0] == "done":
                moments.pop(0)
            else:
                disk.apply(*entry)
            # When a step has ended, what it did is there to stay.
            allowed = moments[:1] if entry[0] == "done" else moments[:2]
            for state in disk.states():
                met += 1
                key = (len(moments), len(allowed), frozenset(state.items()))
                if key in seen:
                    continue
                seen.add(key)
                folder = scratch / f"state-{len(seen)}"
                lay_down(state, folder)
                with store_calls(unforced):
                    old_or_new(snapshot(folder), allowed[0], allowed[-1])
                    for step in scenario.steps(folder):
                        step()
                assert snapshot(folder) == goal
                litter |= set(listing(folder)).symmetric_difference(files)
                shutil.rmtree(folder)
        return met, len(seen), litter

    return check


def unforced(name, call, *arguments, **options):
    """A system call; but nothing crashes here, so that nothing needs to be forced to the disk."""
    return None if name == "fsync" else call(*arguments, **options)


NAMES = [
    "first runs",
    pytest.param("a stale run", marks=pytest.mark.slow),
    "a stale run that had companions",
    "a stale run that had none",
    "removal",
]


@pytest.fixture
def recorded(scenarios, record, snapshot, scratch):
    """A scenario, a disk as it was before, the journal, and the folder as it is afterwards."""

    def done(name, heedless=None):
        scenario, whole = scenarios[name], scratch / "whole"
        scenario.before(whole)
        disk = Disk(whole, heedless)
        journal = record(scenario.steps(whole), lambda: snapshot(whole))
        return scenario, disk, journal, whole

    return done


@pytest.mark.parametrize("name", NAMES)
def test_every_crash_leaves_old_or_new_and_is_gone_on_from(
    recorded, checked_states, evidence, name
):
    met, different, litter = checked_states(*recorded(name))
    evidence(f"{name}: {met} of {met} crash states ({different} different ones) are old or new")
    assert met > 200
    assert different > 20
    assert litter == set()


@pytest.mark.parametrize("heedless", [File, Folder])
def test_a_disk_that_is_forced_to_nothing_would_be_noticed(recorded, checked_states, heedless):
    with pytest.raises((AssertionError, ResultsError)):
        checked_states(*recorded("first runs", heedless))


def test_the_model_of_the_disk_ends_like_the_real_one(recorded):
    _, disk, journal, whole = recorded("a stale run")
    for entry in journal:
        if entry[0] != "done":
            disk.apply(*entry)
    assert contents_of(disk.top, whole) == {
        path: path.read_bytes() for path in whole.rglob("*") if path.is_file()
    }


def contents_of(folder, path):
    """Contents of all files as a living process sees them."""
    found = {}
    for name, node in folder.names.items():
        if isinstance(node, File):
            found[path / name] = node.content
        else:
            found |= contents_of(node, path / name)
    return found


@pytest.mark.skipif(not hasattr(os, "waitid"), reason="tells a process's end without taking it")
def test_what_a_killed_process_left_is_abandoned_though_nobody_waited_for_it():
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        name = temporary_name("run").replace(f"~{os.getpid()}~", f"~{process.pid}~")
        assert not is_abandoned(name)
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert is_abandoned(name)
    assert is_abandoned(name)
    assert not is_abandoned(temporary_name("run"))
