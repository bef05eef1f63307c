"""Notice of compilation, and the cache of compiled kernels."""

import json
import subprocess
import sys

import numba
import pytest
from numba.core.caching import CacheImpl

from trackmark.bench.cli import _message_of
from trackmark.bench.numba_compilation import SENTENCE


@pytest.mark.slow
def test_compilation_by_a_worker_is_printed_once(trackmark_process, workspace, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(workspace / "kernels"))
    options = ("--sequences", "data/Small", "--json", "--jobs", 1)
    first = trackmark_process("run", "--trackers", "camshift", *options)
    assert first.stderr.count(SENTENCE) == 1
    assert [json.loads(line)["status"] for line in first.stdout.splitlines()] == ["finished"]


@pytest.mark.slow
def test_compilation_by_the_command_is_printed_only_once(trackmark_process, workspace, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(workspace / "kernels"))
    command = ("show", "plain/target:length=10", "--frames", 1, "--output")
    for file, count in (("strip.png", 1), ("again.png", 0)):
        done = trackmark_process(*command, file)
        assert done.stderr.count(SENTENCE) == count


def test_missing_folder_for_kernels_is_reported_with_the_remedy(monkeypatch):
    monkeypatch.setattr(CacheImpl, "_locator_classes", [])
    with pytest.raises(RuntimeError) as caught:
        numba.njit(cache=True)(lambda: 0)
    message = _message_of(caught.value)
    assert message.endswith(". Set NUMBA_CACHE_DIR to a writable folder.")


def test_invalid_number_of_threads_is_one_line(trackmark_process, monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "0")
    done = trackmark_process("run", "--trackers", "camshift", "--sequences", "data/Small", status=2)
    assert done.stderr == "trackmark: NUMBA_NUM_THREADS is '0'. Expected: 1 or more.\n"


def test_one_process_at_a_time_compiles_a_kernel(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    script = (
        "from trackmark.bench.numba_compilation import prepare_numba\n"
        "prepare_numba()\n"
        "prepare_numba()\n"  # as if a command was called twice: one lock is enough
        "from trackmark.trackers.maps.back_projection import hue_bin\n"
        "hue_bin(1, 2, 3, 4)\n"
        "print(sum(hue_bin.stats.cache_misses.values()))"
    )
    workers = [
        subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) for _ in range(2)
    ]
    assert sorted(worker.communicate(timeout=300)[0] for worker in workers) == [b"0\n", b"1\n"]
