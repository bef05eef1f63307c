"""Errors of the machine are distinguished from failures of trackers and sequences."""

import errno
import resource
import tempfile

import pytest

from trackmark.bench import operating_system
from trackmark.bench.experiments.tracker_spec import resolve_specs
from trackmark.bench.operating_system import MachineError, machine_fault, temporary_file
from trackmark.datasets.decoding import SequenceError, decoding


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.ENFILE])
def test_machine_fault_is_found_among_causes(number):
    with pytest.raises(SequenceError) as caught, decoding("A.png cannot be read"):
        raise OSError(number, "reason", "A.png")
    assert str(machine_fault(caught.value)).startswith("A.png: ")


@pytest.mark.parametrize("error", [OSError(errno.ENOENT, "no file"), ValueError("ENOSPC")])
def test_other_errors_are_no_machine_fault(error):
    assert machine_fault(error) is None


def test_open_files_are_a_machine_fault_if_the_limit_is_low(monkeypatch):
    error = OSError(errno.EMFILE, "Too many open files")
    assert machine_fault(error) is None  # a tracker has opened them
    monkeypatch.setattr(resource, "getrlimit", lambda _: (64, 64))
    assert "ulimit -n" in str(machine_fault(error))


@pytest.mark.parametrize(
    ("number", "advice"), [(errno.EROFS, "TMPDIR"), (errno.EMFILE, "ulimit -n")]
)
def test_temporary_file_names_reason_and_remedy(number, advice, monkeypatch):
    def refuse(**_):
        raise OSError(number, "reason")

    monkeypatch.setattr(tempfile, "TemporaryFile", refuse)
    with pytest.raises(MachineError, match=advice):
        temporary_file()


def test_full_disk_is_no_failure_of_a_tracker_file(tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text("")

    def refuse(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(operating_system.tempfile, "mkstemp", refuse)
    with pytest.raises(MachineError, match=r"No space left on device\. Free some space"):
        resolve_specs([str(tmp_path / "mine.py")])


def test_command_prints_a_machine_fault_in_one_line(trackmark, monkeypatch):
    def refuse(*_, **__):
        raise SequenceError("A.png is damaged.") from OSError(errno.ENFILE, "reason")

    monkeypatch.setattr("trackmark.datasets.load", refuse)
    printed = trackmark("show", "data/Small", "--output", "strip.png", status=2).stderr
    assert printed.strip().endswith(
        "Too many open files in system. End other processes, and start again."
    )
