"""Trackers that harm their process in frame 3. Until then they return the init box.

`hostile_answers.py` has trackers that raise exceptions or return malformed estimates.
"""

HERE = r"^0003\.png: "
FIRST = r"^0000\.png: "
ENDED = r".*hostile.py:\w+: the process ended with status "
KILLED = r".*hostile.py:\w+: the process ended by signal "
SILENT = r".*hostile.py:\w+: the process did not answer in "
LINE = r' s\. Its last call: File ".*hostile.py", line \d+ in '

HEAD = '''
import ctypes
import mmap
import os
import random
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from trackmark.trackers.base.interface import Estimate, Randomness, TrackerPlugin

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
        """Act in `init`."""

    def strike(self, image):
        """Act in frame 3; may return an estimate."""


def to_descriptors(call, first=0):
    for descriptor in range(first, 64):
        try:
            call(descriptor)
        except OSError:
            pass


class Calm(TrackerPlugin):
    """Tracker whose boxes depend on all pixels, and its details on the process state."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        self.box = box.copy()
        self.random = np.random.default_rng(self.seed)
        self.state = os.getcwd(), dict(os.environ)

    def update(self, image):
        self.box[:2] += self.random.normal(size=2)
        same = self.state == (os.getcwd(), dict(os.environ))
        details = {"same": same, "strict": np.geterr()["divide"] == "raise"}
        return Estimate(self.box + [image.mean(), image.std(), 0, 0], details=details)
'''

METHODS = {
    "begin": "begin(self, image)",
    "strike": "strike(self, image)",
    "made": "__init__(self, parameters, seed)",
    "dropped": "__del__(self)",
}

# Pattern of the failure (empty: none); method, unless `strike`; lines.
CLASSES = {
    # Exceptions
    "RaisesWhenMade": (FIRST + "RuntimeError: unmade", "made", "raise RuntimeError('unmade')"),
    "Interrupts": (HERE + "KeyboardInterrupt", "raise KeyboardInterrupt"),
    # Image that the trackers share
    "WritesToImagesBase": (  # a copy of its own
        "",
        "strike",
        "owner = image",
        "while isinstance(owner.base, np.ndarray): owner = owner.base",
        "owner.flags.writeable = True",
        "owner[:] = 0",
    ),
    # Crashes
    "EndsAtOnce": (FIRST + ENDED + "3", "begin", "os._exit(3)"),
    "Segfaults": (
        HERE + KILLED + r"11 .*\. Its last call: File .*hostile.py\", line \d+ in strike",
        "ctypes.string_at(0)",
    ),
    "SignalsItself": (HERE + KILLED + "40", "os.kill(os.getpid(), 40)"),
    "RecursesDeeply": (
        HERE + KILLED + "11",
        "strike",
        "sys.setrecursionlimit(10**9)",
        "def further(function): return [*map(function, [function])]",
        "return further(further)",
    ),
    # Other processes and threads
    "Forks": (HERE + ".*forked a copy of itself", "os.fork()"),
    # File descriptors: output, channel, shared file
    "ClosesDescriptors": (HERE + ENDED, "os.closerange(0, 256)"),
    "WritesToDescriptors": ("", "to_descriptors(lambda d: os.write(d, b'rubbish'))"),
    "TruncatesFiles": (
        "",
        "to_descriptors(lambda d: os.ftruncate(d, 0))",
    ),
    "OverwritesFiles": ("", "to_descriptors(lambda d: os.pwrite(d, b'\\xff' * 9999, 0), 3)"),
    "LeaksDescriptors": (
        "",
        "strike",
        "self.opened = []",
        "try:",
        "    while True: self.opened.append(os.open(os.devnull, os.O_RDONLY))",
        "except OSError: pass",
    ),
    "Prints": (
        "",
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
        HERE + ENDED + "3",
        "strike",
        "print('famous last \\udcff words')",
        "os._exit(3)",
    ),
    # State of the process
    "DrawsFromNumpy": (
        "",
        "return Estimate(self.box + [np.random.random(), 0, 0, 0])",
    ),
    "ChangesSurroundings": (
        "",
        "strike",
        "os.chdir('/')",
        "os.environ.clear()",
        "np.seterr(all='raise')",
        "os.umask(0o777)",
    ),
    # Memory
    "AllocatesAtOnce": (
        HERE + ".*emory",
        "return Estimate(self.box, arrays={'all': np.ones(100 << 30, np.uint8)})",
    ),
    "Leaks": (
        HERE + ".*emory",
        "strike",
        "self.taken = []",
        "while True: self.taken.append(np.empty(64 << 20, np.uint8))",
    ),
    "AllocatesInC": (
        HERE + KILLED + "11",
        "strike",
        "libc = ctypes.CDLL(None)",
        "libc.malloc.restype = ctypes.c_void_p",
        "while True: libc.memset(ctypes.c_void_p(libc.malloc(64 << 20)), 1, 1)",
    ),
    # Hangs; `hang` writes the process id, so that the clock of the tests advances
    "HangsInPython": (
        HERE + SILENT + "2" + LINE + "strike",
        "strike",
        "note_hang()",
        "while True: pass",
    ),
    "HangsInC": (HERE + SILENT + "2" + LINE + "hang", "hang()"),
    "HangsWithoutThreads": (
        HERE + SILENT + "2" + LINE + "strike",
        "strike",
        "note_hang()",
        "ctypes.PyDLL(None).usleep(2_000_000_000)",  # holds Python's lock
    ),
    "HangsWhenMade": (FIRST + SILENT + "300" + LINE + "hang", "made", "hang()"),
    "HangsWhenDropped": (
        "",  # when the run is complete
        "dropped",
        "if getattr(self, 'frame', 0) >= STRIKE: hang()",
    ),
    "StopsItself": (
        HERE + SILENT + r"2 s\.$",
        "strike",
        "note_hang()",
        "os.kill(os.getpid(), signal.SIGSTOP)",
    ),
}

EVERYDAY = [
    *("Segfaults", "ClosesDescriptors", "Prints", "PrintsAndEnds", "DrawsFromNumpy", "Leaks")
]


def hangs(name):
    """Return whether a tracker never returns."""
    return name.startswith(("Hangs", "Stops"))


def source(marker):
    """Return the Python source of all classes; `marker`: file that holds the process that hangs."""
    text = f'"""{__doc__}"""\n{HEAD}'
    text += f"\n\ndef note_hang():\n    Path({str(marker)!r}).write_text(str(os.getpid()))\n"
    text += "\n\ndef hang():\n    note_hang()\n    time.sleep(FOREVER)\n"
    for name, (_, *acts) in CLASSES.items():
        method, *lines = acts if acts[1:] else ("strike", *acts)
        body = "".join(f"        {line}\n" for line in lines)
        text += f"\n\nclass {name}(Hostile):\n    def {METHODS[method]}:\n{body}"
    return text
