"""Temporary paths: removed by their owner, or by a later start if the owner was killed."""

import signal
import subprocess
import sys

import pytest

from tests.bench.external.conftest import HOME
from trackmark.bench.operating_system import TemporaryPath, temporary_folder

CODE = """
import signal, sys
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # also if the tests run under nohup
sys.path.insert(0, {home!r})
from trackmark.bench.operating_system import TemporaryPath
owned = [TemporaryPath({folder!r}, suffix=".bmp", is_file=is_file) for is_file in (True, False)]
(owned[1].path / "content").write_text("x")
print("ready", flush=True)
sys.stdin.read()
"""


def names(folder):
    return [path.name for path in folder.iterdir()]


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL, None])
def test_paths_of_an_ended_process_are_removed(tmp_path, end):
    code = CODE.format(home=str(HOME), folder=str(tmp_path))
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", code], **pipes) as owner:
        owner.stdout.readline()
        with temporary_folder(tmp_path) as folder:
            assert len(names(tmp_path)) == 3  # paths of a running process stay
        assert not folder.exists()
        if end is not None:
            owner.send_signal(end)
        owner.communicate()
    assert len(names(tmp_path)) == (0 if end is None else 2)
    (tmp_path / "trackmark-results").mkdir()
    newer = TemporaryPath(tmp_path)
    assert {*names(tmp_path)} == {newer.path.name, "trackmark-results"}
    newer.close()
    assert names(tmp_path) == ["trackmark-results"]
