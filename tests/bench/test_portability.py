"""Commands in a simulated Python without the features that only POSIX or Linux has."""

import subprocess
import sys
import textwrap

import pytest

SITECUSTOMIZE = '''
"""Python without modules and functions that Windows does not have, in all child processes."""
import builtins, io, os, select, signal, subprocess, sys

for name in ("fcntl", "resource", "termios", "grp", "pwd"):
    sys.modules[name] = None
for module, names in (
    (os, ["fork", "forkpty", "killpg", "getpgid", "setsid", "pread", "pwrite", "sysconf"]),
    (os, ["mkfifo", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "sched_getaffinity"]),
    (signal, ["SIGKILL", "SIGSTOP", "SIGCONT", "SIGUSR1", "SIGHUP", "pthread_sigmask"]),
    (select, ["poll", "epoll"]),
):
    for name in names:
        if hasattr(module, name):
            delattr(module, name)

class Popen(subprocess.Popen):
    """As in Windows, processes inherit only their streams, and `kill` is `terminate`."""

    def __init__(self, *arguments, **options):
        assert not options.get("pass_fds") and not options.get("preexec_fn"), options
        super().__init__(*arguments, **options)

    def kill(self):
        self.terminate()

subprocess.Popen = Popen

def without_proc(function):
    def call(path, *arguments, **options):
        if isinstance(path, (str, os.PathLike)) and os.fspath(path).startswith("/proc"):
            raise FileNotFoundError(2, "No such file or directory", os.fspath(path))
        return function(path, *arguments, **options)
    return call

os.access = lambda path, mode: path != "/dev/shm"
builtins.open = io.open = without_proc(open)
for name in ("open", "scandir", "listdir", "stat", "readlink"):
    setattr(os, name, without_proc(getattr(os, name)))
open(os.path.join(os.path.dirname(__file__), f"{os.getpid()}.simulated"), "w").close()
'''

SCRIPT = """
import sys
from trackmark.bench.cli import main

def command(text, status=0):
    try:
        main(text.split())
    except SystemExit as ended:
        assert ended.code in (status, None), (text, ended.code)

assert sys.modules["fcntl"] is None
"""
RUN = "run --trackers static,camshift,knob.py --sequences data/Small,data/Other --name trial"
COMMANDS = f"""
command("{RUN} --jobs 2 --repetitions 2")
command("{RUN} --jobs 2 --repetitions 2 --dry-run")
"""
EVALUATION = """
import numpy as np
import trackmark as tm

runs = tm.evaluate(["static", "knob.py"], "data/Small")
assert len(runs) == 2
assert "success_auc" in tm.score(np.tile([5.0, 6, 10, 12], (5, 1)), "data/Small", metrics="otb")
"""
OTHERS = """
command("--help")
command("list")
command("compare --results results/trial")
command("report results/trial")
command("compare static --against camshift --sequences data/Small,data/Other --jobs 1", 0)
"""


@pytest.fixture
def run_script(workspace, otb):
    """Run a script in the simulated Python."""
    otb(workspace / "data" / "Other", 6)
    (workspace / "site").mkdir()
    (workspace / "site" / "sitecustomize.py").write_text(SITECUSTOMIZE)

    def run(*parts):
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT + "".join(map(textwrap.dedent, parts))],
            cwd=workspace,
            env={
                "PYTHONPATH": str(workspace / "site"),
                "TRACKMARK_CACHE": str(workspace / "cache"),
                "TMPDIR": str(workspace),
            },
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
        return done

    return run


def test_runs_need_no_feature_of_posix(run_script, workspace):
    done = run_script(COMMANDS)
    assert "8 of 8 runs are in results/trial" in done.stderr + done.stdout
    # The command, the import of the tracker file, two workers, and a process of the tracker.
    assert len(list(workspace.glob("site/*.simulated"))) >= 5


@pytest.mark.slow
def test_all_commands_need_no_feature_of_posix(run_script):
    run_script(COMMANDS, EVALUATION, OTHERS)
