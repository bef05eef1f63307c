"""Trackers that do in frame 3 what no tracker should; each stays where it began until then."""

import ctypes
import os
import random
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackers.base.interface import Estimate, TrackerPlugin

STRIKE = 3
FOREVER = 1e9


class Hostile(TrackerPlugin):
    """Does nothing yet."""

    def init(self, image, box, mask=None):
        self.box = box.copy()
        self.frame = 0
        self.begin(image)

    def update(self, image):
        self.frame += 1
        answer = self.strike(image) if self.frame == STRIKE else None
        return Estimate(self.box.copy()) if answer is None else answer

    def begin(self, image):
        """What it does in `init`."""

    def strike(self, image):
        """What it does in frame 3; it may give an answer of its own."""


# What it raises


class RaisesAtOnce(Hostile):
    def begin(self, image):
        raise RuntimeError("no wish to begin")


class Raises(Hostile):
    def strike(self, image):
        raise RuntimeError("no wish to go on")


class RaisesWhenMade(Hostile):
    def __init__(self, parameters, seed):
        raise RuntimeError("no wish to be made")


class Exits(Hostile):
    def strike(self, image):
        sys.exit(0)


class Interrupts(Hostile):
    def strike(self, image):
        raise KeyboardInterrupt


class StopsIteration(Hostile):
    def strike(self, image):
        raise GeneratorExit


class Recurses(Hostile):
    def strike(self, image):
        return self.strike(image)


class RaisesAtLength(Hostile):
    def strike(self, image):
        raise RuntimeError("x" * 50_000_000)


class UnspeakableError(Exception):
    def __str__(self):
        raise RuntimeError("this error has no text")


class RaisesTheUnspeakable(Hostile):
    def strike(self, image):
        raise UnspeakableError


# What it answers


class AnswersNaN(Hostile):
    def strike(self, image):
        return Estimate(self.box * np.nan)


class AnswersInfinity(Hostile):
    def strike(self, image):
        return Estimate(self.box + np.inf)


class AnswersNegativeSize(Hostile):
    def strike(self, image):
        return Estimate(self.box * [1, 1, -1, 1])


class AnswersWrongShape(Hostile):
    def strike(self, image):
        return Estimate(self.box[:3])


class AnswersList(Hostile):
    def strike(self, image):
        return Estimate(self.box.tolist())


class AnswersNothing(Hostile):
    def update(self, image):
        self.frame += 1
        return Estimate(self.box.copy()) if self.frame < STRIKE else None


class AnswersTextDetail(Hostile):
    def strike(self, image):
        return Estimate(self.box.copy(), details={"mood": "bad"})


# What it does to the image that others see too


class WritesToImage(Hostile):
    def strike(self, image):
        image[:] = 0


class UnlocksImage(Hostile):
    def strike(self, image):
        image.flags.writeable = True
        image[:] = 0


class WritesToImagesBase(Hostile):
    def strike(self, image):
        owner = image
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        owner.flags.writeable = True
        owner[:] = 0


class WritesToBuffersOwner(Hostile):
    """The owner of a read-only buffer's memory can be asked for."""

    def strike(self, image):
        owner = image
        while True:
            below = owner.obj if isinstance(owner, memoryview) else getattr(owner, "base", None)
            if below is None:
                break
            owner = below
        owner.flags.writeable = True
        owner[:] = 0


class KeepsTheBox(Hostile):
    """Answers with one array that it changes afterwards."""

    def update(self, image):
        self.box += 1
        return Estimate(self.box)


# What it does to the process


class EndsWell(Hostile):
    def strike(self, image):
        os._exit(0)


class EndsBadly(Hostile):
    def strike(self, image):
        os._exit(3)


class EndsAtOnce(Hostile):
    def begin(self, image):
        os._exit(3)


class Segfaults(Hostile):
    def strike(self, image):
        ctypes.string_at(0)


class Aborts(Hostile):
    def strike(self, image):
        os.abort()


class RecursesDeeply(Hostile):
    def strike(self, image):
        sys.setrecursionlimit(10**9)
        return self._further(self._further)

    def _further(self, function):
        return [*map(function, [function])]


class KillsItself(Hostile):
    def strike(self, image):
        os.kill(os.getpid(), signal.SIGKILL)


class TerminatesItself(Hostile):
    def strike(self, image):
        os.kill(os.getpid(), signal.SIGTERM)


class InterruptsItself(Hostile):
    def strike(self, image):
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.1)


class SetsAnAlarm(Hostile):
    """Its alarm comes when somebody else is at work."""

    def strike(self, image):
        signal.setitimer(signal.ITIMER_REAL, 0.3)


class HandlesSignals(Hostile):
    def strike(self, image):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, signal.SIG_IGN)


class Forks(Hostile):
    """Both copies come back."""

    def strike(self, image):
        os.fork()


class ForksAtOnce(Hostile):
    def begin(self, image):
        os.fork()


class LeavesChildren(Hostile):
    def strike(self, image):
        subprocess.Popen(["sleep", "1000"])


class LeavesDaemons(Hostile):
    """Children that are in no session of ours."""

    def strike(self, image):
        subprocess.Popen(["sleep", "1000"], start_new_session=True)


class InterruptsTheCommand(Hostile):
    """As if somebody typed Ctrl-C."""

    def strike(self, image):
        os.kill(os.getppid(), signal.SIGINT)


class KillsTheCommand(Hostile):
    def strike(self, image):
        os.kill(os.getppid(), signal.SIGKILL)


class StartsThread(Hostile):
    def strike(self, image):
        threading.Thread(target=time.sleep, args=[FOREVER]).start()


class ClosesDescriptors(Hostile):
    def strike(self, image):
        os.closerange(0, 256)


class ClosesAndOpensDescriptors(Hostile):
    def strike(self, image):
        os.closerange(0, 256)
        self.opened = [os.open(os.devnull, os.O_RDWR) for _ in range(256)]


class LeaksDescriptors(Hostile):
    """Opens files until it can open no more, and keeps them open."""

    def strike(self, image):
        self.opened = []
        try:
            while True:
                self.opened.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            pass


class ForbidsFiles(Hostile):
    """Nobody in the process can write a file any more."""

    def strike(self, image):
        resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


class WritesToDescriptors(Hostile):
    def strike(self, image):
        for descriptor in range(256):
            try:
                os.set_blocking(descriptor, False)
                os.write(descriptor, b"rubbish" * 10)
            except OSError:
                pass


class Prints(Hostile):
    """Five megabytes, one way and another."""

    def strike(self, image):
        for _ in range(50):
            sys.stdout.write("loud " * 10_000)
            os.write(1, b"loud " * 5_000)
            os.write(2, b"loud " * 5_000)


class PrintsAndRaises(Hostile):
    def strike(self, image):
        for i in range(100_000):
            sys.stdout.write(f"word {i}\n")
        raise RuntimeError("said enough")


class PrintsAndEnds(Hostile):
    def strike(self, image):
        sys.stdout.write("famous last words\n")
        sys.stdout.flush()
        os._exit(3)


class ChangesFolder(Hostile):
    def strike(self, image):
        os.chdir("/")


class ChangesEnvironment(Hostile):
    def strike(self, image):
        os.environ.clear()
        os.environ["TRACKMARK_CACHE"] = "/nowhere"


class RemovesItsSource(Hostile):
    def strike(self, image):
        Path(__file__).unlink()


class ChangesArithmetic(Hostile):
    def strike(self, image):
        np.seterr(all="raise")


class DrawsFromNumpy(Hostile):
    def strike(self, image):
        return Estimate(self.box + [np.random.random(), 0, 0, 0])  # noqa: NPY002


class DrawsFromRandom(Hostile):
    def strike(self, image):
        return Estimate(self.box + [random.random(), 0, 0, 0])


class ReseedsNumpy(Hostile):
    def strike(self, image):
        np.random.seed(0)  # noqa: NPY002


class ReseedsRandom(Hostile):
    def strike(self, image):
        random.seed(0)


# What never ends


class HangsInPython(Hostile):
    def strike(self, image):
        while True:
            pass


class HangsInC(Hostile):
    def strike(self, image):
        time.sleep(FOREVER)


class HangsWithoutThreads(Hostile):
    """Holds the interpreter's lock, so that no other thread runs."""

    def strike(self, image):
        ctypes.PyDLL(None).usleep(2_000_000_000)


class HangsAtOnce(Hostile):
    def begin(self, image):
        time.sleep(FOREVER)


class HangsWhenMade(Hostile):
    def __init__(self, parameters, seed):
        time.sleep(FOREVER)


class Endless(Mapping):
    def __getitem__(self, key):
        return 0.0

    def __len__(self):
        return 1

    def __iter__(self):
        time.sleep(FOREVER)
        yield "never"


class HangsInItsAnswer(Hostile):
    def strike(self, image):
        return Estimate(self.box.copy(), details=Endless())


class LongError(Exception):
    def __str__(self):
        time.sleep(FOREVER)
        return "never"


class HangsInItsError(Hostile):
    def strike(self, image):
        raise LongError


class HangsWhenDropped(Hostile):
    def __del__(self):
        if getattr(self, "frame", 0) >= STRIKE:
            time.sleep(FOREVER)


class IsSlow(Hostile):
    """Each frame is within its limit, all together are not."""

    def update(self, image):
        time.sleep(0.5)
        return super().update(image)


# What it takes


class AllocatesAtOnce(Hostile):
    def strike(self, image):
        return Estimate(self.box, arrays={"all": np.ones(100 << 30, np.uint8)})


class Allocates(Hostile):
    def strike(self, image):
        taken = []
        while True:
            taken.append(np.empty(64 << 20, np.uint8))


class AllocatesInC(Hostile):
    """Nobody in Python hears of it when this fails."""

    def strike(self, image):
        libc = ctypes.CDLL(None)
        libc.malloc.restype = ctypes.c_void_p
        while True:
            libc.memset(ctypes.c_void_p(libc.malloc(64 << 20)), 1, 1)
