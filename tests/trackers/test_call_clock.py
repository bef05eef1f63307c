"""Clock of tracker calls, with real threads, processes and occupied processors."""

import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from trackmark.trackers.base import call_clock
from trackmark.trackers.base.call_clock import (
    CallClock,
    device_name,
    synchronise,
)

needs_run_delay = pytest.mark.skipif(
    not CallClock().has_run_delay, reason="the system does not count run delay"
)


def compute(seconds):
    """Use a processor for a CPU time."""
    end = time.thread_time() + seconds
    while time.thread_time() < end:
        pass


def timed(call):
    clock = CallClock()
    clock.start()
    call()
    return clock.stop()


def test_waiting_counts_as_time_but_not_as_cpu_time():
    times = timed(lambda: time.sleep(0.05))
    assert times.seconds >= 0.05 - times.run_delay
    assert times.cpu < 0.025


def test_work_of_other_threads_counts_as_cpu_time():
    def work():
        threads = [threading.Thread(target=compute, args=(0.02,)) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    assert timed(work).cpu >= 0.04


def test_work_of_ended_child_counts_as_children():
    code = "import time\nwhile time.process_time() < 0.05: pass"
    times = timed(lambda: subprocess.run([sys.executable, "-c", code], check=True))
    assert times.children >= 0.05
    assert times.seconds > times.cpu


@needs_run_delay
def test_run_delay_of_occupied_processor_is_no_time():
    """Two threads of computation on one processor wait for each other."""
    allowed = os.sched_getaffinity(0)
    code = (
        f"import os\nos.sched_setaffinity(0, {{{min(allowed)}}})\nprint(flush=True)\nwhile 1: pass"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        os.sched_setaffinity(0, {min(allowed)})
        began = time.perf_counter()
        try:
            times = timed(lambda: compute(0.1))
            wall = time.perf_counter() - began
        finally:
            os.sched_setaffinity(0, allowed)
            other.kill()
    assert times.run_delay > 0.02
    # The time excludes the run delay: what is left is the computation.
    assert 0.099 < times.seconds < wall - 0.02


@needs_run_delay
def test_clock_closes_its_descriptor():
    def count():
        return sum(1 for _ in Path("/proc/self/fd").iterdir())

    before, clock = count(), CallClock()
    clock.start()
    assert count() == before + 1
    del clock
    assert count() == before


def test_clock_without_run_delay_is_wall_time(monkeypatch):
    monkeypatch.setattr(call_clock, "_SCHEDSTAT", "/none")
    assert not CallClock().has_run_delay
    times = timed(lambda: time.sleep(0.01))
    assert times.seconds >= 0.01
    assert times.run_delay == 0


class Waits:
    device = "Accelerator 9"

    def __init__(self):
        self.waited = 0

    def synchronise(self):
        self.waited += 1


@pytest.fixture
def torch(monkeypatch):
    """Stand in for PyTorch and count its synchronisations."""
    calls = []
    cuda = SimpleNamespace(
        is_initialized=lambda: True,
        synchronize=lambda: calls.append("synchronize"),
        get_device_name=lambda: "Stand-in GPU",
    )
    module = SimpleNamespace(cuda=cuda, calls=calls)
    monkeypatch.setitem(sys.modules, "torch", module)
    return module


def test_tracker_without_method_waits_for_cuda(torch):
    synchronise(object())
    assert torch.calls == ["synchronize"]
    torch.cuda.is_initialized = lambda: False
    synchronise(object())
    assert torch.calls == ["synchronize"]


def test_method_of_tracker_replaces_waiting_for_cuda(torch):
    tracker = Waits()
    synchronise(tracker)
    assert tracker.waited == 1
    assert torch.calls == []


def test_device_name_is_that_of_tracker_or_pytorch(torch):
    assert device_name(Waits()) == "Accelerator 9"
    assert device_name(SimpleNamespace()) == "Stand-in GPU"
    torch.cuda.is_initialized = lambda: False
    assert device_name(SimpleNamespace()) == ""
