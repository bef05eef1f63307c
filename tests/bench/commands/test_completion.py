"""Shell completion: a test types commands into each shell."""

import fcntl
import os
import pty
import select
import shutil
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

SCRIPTS = Path(sys.executable).parent
MAX_SECONDS = 120  # seconds, also on a busy machine

SHELLS = {
    "bash": (
        ["bash", "--noprofile", "--norc", "-i"],
        'eval "$(_TRACKMARK_COMPLETE=bash_source trackmark)"',
    ),
    "zsh": (
        ["zsh", "-f", "-i"],
        'autoload -Uz compinit; compinit -u -D; eval "$(_TRACKMARK_COMPLETE=zsh_source trackmark)"',
    ),
    "fish": (
        ["fish", "--no-config", "-i"],
        "_TRACKMARK_COMPLETE=fish_source trackmark | source",
    ),
}


class Shell:
    """Interactive shell in a pseudo-terminal; `text` is what it has printed."""

    def __init__(self, command, folder):
        self._terminal, terminal = pty.openpty()
        home = {"HOME": str(folder), "XDG_DATA_HOME": str(folder), "XDG_CONFIG_HOME": str(folder)}
        path = {"PATH": f"{SCRIPTS}:{os.environ['PATH']}", "TERM": "xterm"}
        self._process = subprocess.Popen(
            command, stdin=terminal, stdout=terminal, stderr=terminal, cwd=folder,
            env=os.environ | home | path, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # fish needs job control
        )  # fmt: skip
        os.close(terminal)
        self.text = ""

    def type(self, keys, expected):
        """Type keys and wait for a text that the shell prints after them."""
        self.text = ""
        os.write(self._terminal, keys.encode())
        end = time.monotonic() + MAX_SECONDS
        while expected not in self.text:
            assert time.monotonic() < end, self.text
            if select.select([self._terminal], [], [], 1)[0]:
                self.text += os.read(self._terminal, 1 << 16).decode(errors="replace")

    def close(self):
        """End the shell."""
        self._process.kill()
        self._process.wait()
        os.close(self._terminal)


@pytest.fixture(params=SHELLS)
def shell(request, tmp_path):
    """Start a shell with the completion of the README."""
    command, setup = SHELLS[request.param]
    assert f"{request.param}_source" in (Path(__file__).parents[3] / "README.md").read_text()
    if shutil.which(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    (tmp_path / "a-rather-long-name.py").touch()
    opened = Shell(command, tmp_path)
    try:
        opened.type(f"{setup}; echo rea''dy\n", "ready")
        yield opened
    finally:
        opened.close()


@pytest.mark.slow
def test_shell_completes_commands_options_and_files(shell):
    shell.type("trackmark comp\t--he\t\n", "Usage: trackmark compare")
    shell.type("trackmark run --trackers a-ra\t", "a-rather-long-name.py")
    assert "Traceback" not in shell.text


def test_unknown_shell_is_refused_in_one_message(trackmark, monkeypatch):
    for request in ("tcsh_source", "1", "bash_complete"):
        monkeypatch.setenv("_TRACKMARK_COMPLETE", request)
        assert "Use bash_source" in trackmark(status=2).stderr
