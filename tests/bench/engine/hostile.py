"""Trackers that do in frame 3 what no tracker should; each stays where it began until then.

What they raise and answer, for which no process is needed, stands in `hostile_answers.py`.
"""

HERE = r"^0003\.png: "
FIRST = r"^0000\.png: "

HEAD = '''
import ctypes
import json
import mmap
import os
import pickle
import random
import resource
import signal
import stat
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from trackmark.trackers.base.interface import Estimate, TrackerPlugin

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


def into_connection(data):
    for descriptor in range(3, 256):
        try:
            if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
                os.write(descriptor, data)
        except OSError:
            pass


class Loaded:
    def __reduce__(self):
        return open, ("loaded", "w")


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

ANSWER = {"overhead": 0.0, "seconds": 0.0, "cpu_seconds": 0.0, "peak_memory": 0, "host": ""}
ANSWER |= {"rows": [], "entries": [], "process": 0}

# Words of the failure, empty where it is none, None where a test of its own says more; and what it
# does, by what it does it in: in `strike` unless it is said.
CLASSES = {
    # What it raises
    "RaisesAtOnce": (
        FIRST + "RuntimeError: no wish to begin",
        "begin",
        "raise RuntimeError('no wish to begin')",
    ),
    "RaisesWhenMade": (
        FIRST + "RuntimeError: no wish to be made",
        "made",
        "raise RuntimeError('no wish to be made')",
    ),
    "Interrupts": (HERE + "it raised KeyboardInterrupt", "raise KeyboardInterrupt"),
    "StopsIteration": (HERE + "it raised GeneratorExit", "raise GeneratorExit"),
    "RaisesMemoryError": (HERE + "MemoryError", "raise MemoryError"),
    # What it does to the image that others see too
    "WritesToImagesBase": (
        HERE + "ValueError",
        "strike",
        "owner = image",
        "while isinstance(owner.base, np.ndarray): owner = owner.base",
        "owner.flags.writeable = True",
        "owner[:] = 0",
    ),
    "WritesToBuffersOwner": (
        "image",  # the owner of a read-only buffer's memory can be asked for
        "strike",
        "owner = below = image",
        "while below is not None:",
        "    owner = below",
        "    view = isinstance(owner, memoryview)",
        "    below = owner.obj if view else getattr(owner, 'base', None)",
        "owner.flags.writeable = True",
        "owner[:] = 0",
    ),
    "KeepsTheBox": ("", "update", "self.box += 1", "return Estimate(self.box)"),  # and changes it
    # What it does to the process
    "EndsWell": (HERE + "its process ended with status 0", "os._exit(0)"),
    "EndsBadly": (HERE + "its process ended with status 3", "os._exit(3)"),
    "EndsAtOnce": (FIRST + "its process ended with status 3", "begin", "os._exit(3)"),
    "Segfaults": (HERE + "its process was killed by SIGSEGV", "ctypes.string_at(0)"),
    "Aborts": (HERE + "its process was killed by SIGABRT", "os.abort()"),
    "RecursesDeeply": (
        HERE + "its process was killed by SIGSEGV",
        "strike",
        "sys.setrecursionlimit(10**9)",
        "def further(function): return [*map(function, [function])]",
        "return further(further)",
    ),
    "KillsItself": (
        HERE + "its process was killed by SIGKILL",
        "os.kill(os.getpid(), signal.SIGKILL)",
    ),
    "TerminatesItself": (
        HERE + "its process was killed by SIGTERM",
        "os.kill(os.getpid(), signal.SIGTERM)",
    ),
    "InterruptsItself": (
        HERE,
        "strike",
        "signal.signal(signal.SIGINT, signal.default_int_handler)",
        "os.kill(os.getpid(), signal.SIGINT)",
        "time.sleep(0.1)",
    ),
    "SetsAnAlarm": (
        "",
        "signal.setitimer(signal.ITIMER_REAL, 0.3)",
    ),  # comes when another is at work
    "HandlesSignals": (
        "",
        "strike",
        "for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGALRM):",
        "    signal.signal(number, signal.SIG_IGN)",
    ),
    "Forks": ("forked", "os.fork()"),  # both copies come back
    "ForksAtOnce": ("forked", "begin", "os.fork()"),
    "LeavesChildren": ("", "subprocess.Popen(['sleep', '1000'])"),
    "LeavesDaemons": ("", "subprocess.Popen(['sleep', '1000'], start_new_session=True)"),
    "InterruptsTheCommand": (
        None,
        "os.kill(os.getppid(), signal.SIGINT)",
    ),  # as if somebody typed Ctrl-C
    "KillsTheCommand": (None, "os.kill(os.getppid(), signal.SIGKILL)"),
    "StartsThread": ("", "threading.Thread(target=time.sleep, args=[FOREVER]).start()"),
    "ClosesDescriptors": (HERE + "it closed file descriptors", "os.closerange(0, 256)"),
    "ClosesAndOpensDescriptors": (
        HERE + "it closed file descriptors",
        "strike",
        "os.closerange(0, 256)",
        "self.opened = [os.open(os.devnull, os.O_RDWR) for _ in range(256)]",
    ),
    "LeaksDescriptors": (
        ".",  # opens files until it can open no more, and keeps them open
        "strike",
        "self.opened = []",
        "try:",
        "    while True: self.opened.append(os.open(os.devnull, os.O_RDONLY))",
        "except OSError: pass",
    ),
    "ForbidsFiles": (
        ".",
        "resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))",
    ),  # to all in the process
    "WritesToDescriptors": (
        "file descriptors",
        "strike",
        "for descriptor in range(256):",
        "    try:",
        "        os.set_blocking(descriptor, False)",
        "        os.write(descriptor, b'rubbish' * 10)",
        "    except OSError: pass",
    ),
    "Prints": (
        "",  # five megabytes, one way and another
        "strike",
        "for _ in range(50):",
        "    sys.stdout.write('loud ' * 10_000)",
        "    os.write(1, b'loud ' * 5_000)",
        "    os.write(2, b'loud ' * 5_000)",
    ),
    "PrintsAndRaises": (
        HERE + "RuntimeError: said enough",
        "strike",
        "for i in range(20_000): sys.stdout.write(f'word {i}\\n')",
        "raise RuntimeError('said enough')",
    ),
    "PrintsAndEnds": (
        HERE + "its process ended with status 3",
        "strike",
        "sys.stdout.write('famous last words\\n')",
        "sys.stdout.flush()",
        "os._exit(3)",
    ),
    "ChangesFolder": ("", "os.chdir('/')"),
    "ChangesEnvironment": (
        "",
        "strike",
        "os.environ.clear()",
        "os.environ['TRACKMARK_CACHE'] = '/nowhere'",
    ),
    "RemovesItsSource": (None, "Path(__file__).unlink()"),
    "ChangesArithmetic": ("", "np.seterr(all='raise')"),
    "DrawsFromNumpy": (
        "global random numbers",
        "return Estimate(self.box + [np.random.random(), 0, 0, 0])",
    ),
    "DrawsFromRandom": (
        "global random numbers",
        "return Estimate(self.box + [random.random(), 0, 0, 0])",
    ),
    "ReseedsNumpy": ("global random numbers", "np.random.seed(0)"),
    "ReseedsRandom": ("global random numbers", "random.seed(0)"),
    "ChangesUmask": ("", "os.umask(0o777)"),
    "ChangesSurroundings": (
        "",  # all of these
        "strike",
        "os.chdir('/')",
        "os.environ.clear()",
        "os.environ['TRACKMARK_CACHE'] = '/nowhere'",
        "np.seterr(all='raise')",
        "os.umask(0o777)",
    ),
    "PatchesTheAnswer": ("ended with status 1", "json.dumps = None"),
    "PatchesTheStore": ("harness fails", "os.link = os.replace = None"),
    "PatchesEverything": (
        ".",
        "strike",
        "for module in (np, os, json, time): module.__dict__.clear()",
    ),
    "ForgetsModules": (".", "sys.modules.clear()"),
    "TruncatesItsRows": (
        "SIGBUS",
        "strike",
        "for file in Path(__file__).parent.rglob(f'*{type(self).__name__}*/*/*.npy'):",
        "    os.truncate(file, 0)",
    ),
    # What it says in its process's name
    "WritesPickle": (
        "wrote into file descriptors",
        "strike",
        "data = pickle.dumps(Loaded())",
        "into_connection(len(data).to_bytes(4, 'big') + data)",
    ),
    "WritesLength": ("wrote into file descriptors", "into_connection(b'\\x7f\\xff\\xff\\xff')"),
    "WritesDepth": ("wrote into file descriptors", "into_connection(b'[' * 99_999 + b'\\n')"),
    "WritesEndlessly": (
        "wrote into file descriptors",
        "while True: into_connection(b' ' * 9999)",
    ),
    "WritesNothing": ("answers for its process", "into_connection(b'{\"result\": null}\\n')"),
    "WritesMore": ("wrote into file descriptors", 'into_connection(b\'{"result": null}\\n{"\')'),
    "WritesDefect": (
        "a defect of ours",
        "strike",
        "said = {'result': None, 'raised': 'DefectError', 'said': 'a defect of ours'}",
        "into_connection(json.dumps(said).encode() + b'\\n')",
    ),
    "WritesAnswer": (
        "nobody asked for",
        f"into_connection(json.dumps({{'result': {ANSWER}}}).encode() + b'\\n')",
    ),
    # What never ends
    "StopsItself": (HERE + "no answer within", "os.kill(os.getpid(), signal.SIGSTOP)"),
    "HangsInPython": (HERE + "no answer within", "while True: pass"),
    "HangsInC": (HERE + "no answer within", "time.sleep(FOREVER)"),
    "HangsWithoutThreads": (
        HERE + "no answer within",
        "ctypes.PyDLL(None).usleep(2_000_000_000)",
    ),  # holds Python's lock
    "HangsAtOnce": (FIRST + "no answer within", "begin", "time.sleep(FOREVER)"),
    "HangsWhenMade": (FIRST + "no answer within", "made", "time.sleep(FOREVER)"),
    "HangsInItsAnswer": (
        HERE + "no answer within",
        "return Estimate(self.box.copy(), details=Endless())",
    ),
    "HangsInItsError": (HERE + "no answer within", "raise LongError"),
    "HangsWhenDropped": (
        "no answer within",
        "dropped",
        "if getattr(self, 'frame', 0) >= STRIKE: time.sleep(FOREVER)",
    ),
    "IsSlow": (
        "limit of 4 s",
        "update",
        "time.sleep(0.5)",
        "return super().update(image)",
    ),  # in all together
    # What it takes
    "TakesSharedMemory": ("", "self.taken = mmap.mmap(-1, 4 << 30)"),  # which no limit counts
    "TakesThreads": (
        "",
        "for _ in range(20): threading.Thread(target=time.sleep, args=[9], daemon=True).start()",
    ),
    "GivesUpFiles": (".", "resource.setrlimit(resource.RLIMIT_NOFILE, (3, 3))"),
    "AllocatesAtOnce": (
        HERE + ".*emory",
        "return Estimate(self.box, arrays={'all': np.ones(100 << 30, np.uint8)})",
    ),
    "Allocates": (
        HERE + ".*emory",
        "strike",
        "taken = []",
        "while True: taken.append(np.empty(64 << 20, np.uint8))",
    ),
    "AllocatesInC": (
        HERE + "its process was killed by SIGSEGV",  # nobody in Python hears of it when this fails
        "strike",
        "libc = ctypes.CDLL(None)",
        "libc.malloc.restype = ctypes.c_void_p",
        "while True: libc.memset(ctypes.c_void_p(libc.malloc(64 << 20)), 1, 1)",
    ),
}


EVERYDAY = [
    # First what takes longest: it hangs until a limit.
    *("HangsInC", "Segfaults", "EndsWell", "KillsItself", "Forks", "ClosesDescriptors"),
    *("DrawsFromNumpy", "AllocatesAtOnce", "ChangesSurroundings", "Prints", "PrintsAndRaises"),
    *("WritesToBuffersOwner", "TakesSharedMemory", "WritesPickle", "WritesAnswer", "WritesDefect"),
]


def source():
    """Python source of all of them."""
    text = f'"""{__doc__}"""\n{HEAD}'
    for name, (_, *acts) in CLASSES.items():
        method, *lines = acts if acts[1:] else ("strike", *acts)
        body = "".join(f"        {line}\n" for line in lines)
        text += f"\n\nclass {name}(Hostile):\n    def {METHODS[method]}:\n{body}"
    return text
