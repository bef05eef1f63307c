"""Trackers that do in frame 3 what no tracker should; each stays where it began until then."""

__all__ = ["source"]

HEAD = '''
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


class UnspeakableError(Exception):
    def __str__(self):
        raise RuntimeError("this error has no text")


class LongError(Exception):
    def __str__(self):
        time.sleep(FOREVER)
        return "never"


class Endless(Mapping):
    def __getitem__(self, key):
        return 0.0

    def __len__(self):
        return 1

    def __iter__(self):
        time.sleep(FOREVER)
        yield "never"
'''

METHODS = {
    "begin": "begin(self, image)",
    "strike": "strike(self, image)",
    "made": "__init__(self, parameters, seed)",
    "update": "update(self, image)",
    "dropped": "__del__(self)",
}

# By what they do it in; in `strike` unless it is said.
CLASSES = {
    # What it raises
    "RaisesAtOnce": ("begin", "raise RuntimeError('no wish to begin')"),
    "Raises": "raise RuntimeError('no wish to go on')",
    "RaisesWhenMade": ("made", "raise RuntimeError('no wish to be made')"),
    "Exits": "sys.exit(0)",
    "Interrupts": "raise KeyboardInterrupt",
    "StopsIteration": "raise GeneratorExit",
    "Recurses": "return self.strike(image)",
    "RaisesAtLength": "raise RuntimeError('x' * 50_000_000)",
    "RaisesTheUnspeakable": "raise UnspeakableError",
    # What it answers; other answers are tested in the loop, where no process is needed
    "AnswersNothing": (
        "update",
        "self.frame += 1",
        "return Estimate(self.box.copy()) if self.frame < STRIKE else None",
    ),
    # What it does to the image that others see too
    "WritesToImage": "image[:] = 0",
    "UnlocksImage": ("strike", "image.flags.writeable = True", "image[:] = 0"),
    "WritesToImagesBase": (
        "strike",
        "owner = image",
        "while isinstance(owner.base, np.ndarray): owner = owner.base",
        "owner.flags.writeable = True",
        "owner[:] = 0",
    ),
    "WritesToBuffersOwner": (  # the owner of a read-only buffer's memory can be asked for
        "strike",
        "owner = below = image",
        "while below is not None:",
        "    owner = below",
        "    view = isinstance(owner, memoryview)",
        "    below = owner.obj if view else getattr(owner, 'base', None)",
        "owner.flags.writeable = True",
        "owner[:] = 0",
    ),
    "KeepsTheBox": ("update", "self.box += 1", "return Estimate(self.box)"),  # and changes it
    # What it does to the process
    "EndsWell": "os._exit(0)",
    "EndsBadly": "os._exit(3)",
    "EndsAtOnce": ("begin", "os._exit(3)"),
    "Segfaults": "ctypes.string_at(0)",
    "Aborts": "os.abort()",
    "RecursesDeeply": (
        "strike",
        "sys.setrecursionlimit(10**9)",
        "def further(function): return [*map(function, [function])]",
        "return further(further)",
    ),
    "KillsItself": "os.kill(os.getpid(), signal.SIGKILL)",
    "TerminatesItself": "os.kill(os.getpid(), signal.SIGTERM)",
    "InterruptsItself": (
        "strike",
        "signal.signal(signal.SIGINT, signal.default_int_handler)",
        "os.kill(os.getpid(), signal.SIGINT)",
        "time.sleep(0.1)",
    ),
    "SetsAnAlarm": "signal.setitimer(signal.ITIMER_REAL, 0.3)",  # comes when another is at work
    "HandlesSignals": (
        "strike",
        "for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGALRM):",
        "    signal.signal(number, signal.SIG_IGN)",
    ),
    "Forks": "os.fork()",  # both copies come back
    "ForksAtOnce": ("begin", "os.fork()"),
    "LeavesChildren": "subprocess.Popen(['sleep', '1000'])",
    "LeavesDaemons": "subprocess.Popen(['sleep', '1000'], start_new_session=True)",
    "InterruptsTheCommand": "os.kill(os.getppid(), signal.SIGINT)",  # as if somebody typed Ctrl-C
    "KillsTheCommand": "os.kill(os.getppid(), signal.SIGKILL)",
    "StartsThread": "threading.Thread(target=time.sleep, args=[FOREVER]).start()",
    "ClosesDescriptors": "os.closerange(0, 256)",
    "ClosesAndOpensDescriptors": (
        "strike",
        "os.closerange(0, 256)",
        "self.opened = [os.open(os.devnull, os.O_RDWR) for _ in range(256)]",
    ),
    "LeaksDescriptors": (  # opens files until it can open no more, and keeps them open
        "strike",
        "self.opened = []",
        "try:",
        "    while True: self.opened.append(os.open(os.devnull, os.O_RDONLY))",
        "except OSError: pass",
    ),
    "ForbidsFiles": "resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))",  # to all in the process
    "WritesToDescriptors": (
        "strike",
        "for descriptor in range(256):",
        "    try:",
        "        os.set_blocking(descriptor, False)",
        "        os.write(descriptor, b'rubbish' * 10)",
        "    except OSError: pass",
    ),
    "Prints": (  # five megabytes, one way and another
        "strike",
        "for _ in range(50):",
        "    sys.stdout.write('loud ' * 10_000)",
        "    os.write(1, b'loud ' * 5_000)",
        "    os.write(2, b'loud ' * 5_000)",
    ),
    "PrintsAndRaises": (
        "strike",
        "for i in range(20_000): sys.stdout.write(f'word {i}\\n')",
        "raise RuntimeError('said enough')",
    ),
    "PrintsAndEnds": (
        "strike",
        "sys.stdout.write('famous last words\\n')",
        "sys.stdout.flush()",
        "os._exit(3)",
    ),
    "ChangesFolder": "os.chdir('/')",
    "ChangesEnvironment": (
        "strike",
        "os.environ.clear()",
        "os.environ['TRACKMARK_CACHE'] = '/nowhere'",
    ),
    "RemovesItsSource": "Path(__file__).unlink()",
    "ChangesArithmetic": "np.seterr(all='raise')",
    "DrawsFromNumpy": "return Estimate(self.box + [np.random.random(), 0, 0, 0])",
    "DrawsFromRandom": "return Estimate(self.box + [random.random(), 0, 0, 0])",
    "ReseedsNumpy": "np.random.seed(0)",
    "ReseedsRandom": "random.seed(0)",
    # What never ends
    "HangsInPython": "while True: pass",
    "HangsInC": "time.sleep(FOREVER)",
    "HangsWithoutThreads": "ctypes.PyDLL(None).usleep(2_000_000_000)",  # holds Python's lock
    "HangsAtOnce": ("begin", "time.sleep(FOREVER)"),
    "HangsWhenMade": ("made", "time.sleep(FOREVER)"),
    "HangsInItsAnswer": "return Estimate(self.box.copy(), details=Endless())",
    "HangsInItsError": "raise LongError",
    "HangsWhenDropped": (
        "dropped",
        "if getattr(self, 'frame', 0) >= STRIKE: time.sleep(FOREVER)",
    ),
    "IsSlow": ("update", "time.sleep(0.5)", "return super().update(image)"),  # in all together
    # What it takes
    "AllocatesAtOnce": "return Estimate(self.box, arrays={'all': np.ones(100 << 30, np.uint8)})",
    "Allocates": ("strike", "taken = []", "while True: taken.append(np.empty(64 << 20, np.uint8))"),
    "AllocatesInC": (  # nobody in Python hears of it when this fails
        "strike",
        "libc = ctypes.CDLL(None)",
        "libc.malloc.restype = ctypes.c_void_p",
        "while True: libc.memset(ctypes.c_void_p(libc.malloc(64 << 20)), 1, 1)",
    ),
}


def source():
    """Python source of all of them."""
    text = f'"""{__doc__}"""\n{HEAD}'
    for name, acts in CLASSES.items():
        method, *lines = ("strike", acts) if isinstance(acts, str) else acts
        body = "".join(f"        {line}\n" for line in lines)
        text += f"\n\nclass {name}(Hostile):\n    def {METHODS[method]}:\n{body}"
    return text
