"""Child process that answers requests of the harness.

Usage, by `start.py`: python worker.py FRAMES HOME OPERATIONS ARGUMENT... OPERATIONS is a class with
the method `perform`, as `module:Class`, which is created with the file FRAMES and the arguments.
HOME is the folder of the package trackmark. If OPERATIONS is empty, the arguments are the file of a
tracker and, optionally, its class. The process then needs Python 3.6 or newer and NumPy, but not
trackmark.

Each request on stdin, `[number, operation, arguments]`, is one line of JSON. So is each answer on
stdout, `[number, answer]` after `MARK`, with the number of the request. Output of the tracker goes
to stderr. After an exception, the answer is `error`, the traceback is on stderr, and the process
ends. If the tracker forks the process, and the copy returns from the call, the copy ends before it
writes anything, and the answer is `problem`, which also ends the process.

| operation and arguments | answer |
|---|---|
| describe | class, name, doc, parameters, randomness, images, libraries |
| create: parameters, seed, entropy, spawn_key | drawn |
| init: pixels, box | time, device, drawn |
| update: pixels | time, device, drawn, estimate; or invalid: the reason why it is no estimate |
| drop | |

These are the operations without trackmark; `bench.external.isolated_worker` has those of the full
interface. FRAMES is a file with the image of each request, and after it the mask of `init`.
`pixels` is a list of their shapes and types. The mask of an estimate is written to the same file;
`estimate` has its shape and type. `time` has the fields of `CallTime`. `drawn` has the names of the
global generators that the run has changed.
"""

import faulthandler
import importlib
import importlib.util
import json
import os
import queue
import select
import signal
import sys
import sysconfig
import threading
import time
import traceback
from typing import Any, Dict, Iterator, List, Tuple

try:
    import numpy as np
except ImportError as error:
    sys.exit("%s cannot import NumPy (%s). Install NumPy there." % (sys.executable, error))


MARK = "@@TRACKMARK:"
FORKED = (
    "forked a copy of itself, which returned from a call of the tracker. Use the module subprocess"
    " or multiprocessing, or end the copy by os._exit"
)
END_SECONDS = 1.0
"""Time that a tracker has to return when the harness has ended [s]."""

COPY_SECONDS = 1.0
"""Time in which a copy of the process returns from the call that has forked it [s]."""


def import_file(path: str, name: str) -> Any:
    """Return the module of a file."""
    spec = importlib.util.spec_from_file_location(name, path)  # type: Any
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


FOLDER = os.path.dirname(os.path.abspath(__file__))
BASE = os.path.join(FOLDER, "..", "..", "trackers", "base")


def import_rules(name: str) -> Any:
    """Return a module of `trackers/base` that needs nothing of trackmark."""
    return import_file(os.path.join(BASE, name + ".py"), "trackmark_" + name)


def serve(operations: Any) -> None:
    """Answer requests until stdin ends, by `operations.perform` in the main thread.

    An answer with the key `problem` or `error` is the last one.
    """
    copies = operations.copies = Copies()
    requests, answers = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # output of the tracker and of its libraries does not mix with the answers
    if hasattr(signal, "SIGUSR1"):  # sent if the harness waits too long
        faulthandler.register(signal.SIGUSR1, all_threads=False)
    lines = queue.Queue()  # type: Any
    threading.Thread(target=queue_requests, args=(requests, lines), daemon=True).start()
    for line in iter(lines.get, ""):
        request_number, operation, arguments = json.loads(line)
        try:
            reply = operations.perform(operation, **arguments)
        except BaseException as error:
            copies.end()
            if isinstance(error, SystemExit):
                raise
            reply = {"error": describe_error(error)}
        copies.end()
        if copies.have_returned():
            reply = {"problem": FORKED}
        answers.write(MARK + json.dumps([request_number, reply], default=convert) + "\n")
        answers.flush()
        if "problem" in reply or "error" in reply:
            sys.stderr.flush()
            os._exit(1)


def describe_error(error: BaseException) -> str:
    """Return the last line of an exception's traceback, which is printed."""
    traceback.print_exception(type(error), error, error.__traceback__)
    return traceback.format_exception_only(type(error), error)[-1].strip()


def convert(value: Any) -> Any:
    """Return a value that JSON does not have as numbers or text."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else repr(value)


def queue_requests(requests: Any, lines: Any) -> None:
    """Pass on requests; end this process and its children when the harness has ended."""
    for line in requests:
        lines.put(line)
    lines.put("")
    time.sleep(END_SECONDS)
    if hasattr(os, "killpg"):
        os.killpg(os.getpgid(0), signal.SIGKILL)
    os._exit(1)


def read_array(file: Any, shape: Any, dtype: Any) -> Any:
    """Return a new array, because a tracker may keep or modify it."""
    array = np.empty(shape, dtype)
    if file.readinto(array) != array.nbytes:
        raise OSError("the file of frames is too short")
    return array


def write_arrays(file: Any, arrays: Any) -> List[Any]:
    """Write arrays to the start of a file; return their shapes and types."""
    file.seek(0)
    for array in arrays:
        file.write(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
    return [[array.shape, array.dtype.str] for array in arrays]


class Copies:
    """Copies of this process: a tracker forks them, and they return from its call by mistake."""

    def __init__(self) -> None:
        self._process = os.getpid()
        self._reader, self._writer = os.pipe()
        self._has_forked = self._is_new = False
        if hasattr(os, "register_at_fork"):  # not on Windows
            os.register_at_fork(after_in_parent=self._note)

    def _note(self) -> None:
        self._has_forked = self._is_new = True

    def end(self) -> None:
        """End this process if it is a copy."""
        if os.getpid() != self._process:
            try:
                os.write(self._writer, b"returned")
            finally:
                os._exit(1)

    def have_returned(self) -> bool:
        """Return whether a copy has returned from a call; wait for a copy that was just forked.

        Processes of `multiprocessing` do not return. They cost this time once, if they still run.
        """
        if not self._has_forked:
            return False
        seconds = COPY_SECONDS if self._is_new and has_children() else 0.0
        self._is_new = False
        return bool(select.select([self._reader], [], [], seconds)[0])


def has_children() -> bool:
    """Return whether this process has child processes; True if the system cannot tell."""
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    except AttributeError:  # macOS
        pass
    return True


class Operations:
    """Base class of operations on trackers, which this process runs one after another.

    `frames` is the file of frames, `clocks` the module `call_clock`. `copies` are the `Copies` of
    this process, which `serve` sets. `_tracker` is the current tracker, and `_generators` is the
    context of its code, an instance of `GlobalGenerators`.
    """

    copies = None  # type: Any
    _generators = _tracker = None  # type: Any

    def __init__(self, frames: Any, clocks: Any) -> None:
        self._frames, self._clocks = frames, clocks
        self._clock = clocks.CallClock()

    def perform(self, operation: str, **arguments: Any) -> Any:
        """Return the answer of an operation."""
        return getattr(self, operation)(**arguments)

    def drop(self) -> Dict[str, Any]:
        """Drop the tracker, whose destructor is the last code of its run."""
        self._tracker = None
        return {}

    def _read(self, pixels: Any) -> Any:
        """Return the images and masks in the file of frames; None for None."""
        self._frames.seek(0)
        return [array and read_array(self._frames, *array) for array in pixels]

    def _call(self, tracker: Any, method: Any, *arguments: Any) -> Tuple[Any, Dict[str, Any]]:
        """Return the result of a method of the tracker, and the facts about the call."""
        with self._generators:
            self._clock.start()
            result = method(*arguments)
            self._clocks.synchronise(tracker)
            reply = {"time": self._clock.stop()}
        self.copies.end()  # before it writes to the file of frames
        device = self._clocks.device_name(tracker)
        return result, dict(reply, device=device, drawn=self._generators.drawn)


class PlainTrackers(Operations):
    """Operations on the trackers of a class that needs nothing of trackmark.

    The class `name` can be empty if the file has one tracker.
    """

    def __init__(self, frames: Any, path: str, name: str = "") -> None:
        Operations.__init__(self, frames, import_rules("call_clock"))
        self._path, self._name = os.path.abspath(path), name
        self._rules, self._estimates, generators = map(
            import_rules, ("plain_class", "estimate_check", "global_generators")
        )
        self._new_generators = generators.GlobalGenerators
        self._class = None  # type: Any

    def describe(self) -> Any:
        """Return the description of the class."""
        sys.path[0] = os.path.dirname(self._path)  # instead of the folder of this file
        sys.argv = [self._path]  # those of this process are not for the file
        stem = os.path.splitext(os.path.basename(self._path))[0]
        self._generators = self._new_generators(0)  # imports get equal numbers in each process
        with self._generators:
            module = import_file(self._path, "trackmark_plugin_" + stem)
        try:
            self._class = self._rules.tracker_class(module, self._name)
            return dict(self._rules.describe(self._class), libraries=dict(libraries()))
        except ValueError as error:
            owner = filter(None, [module.__file__, getattr(self._class, "__name__", self._name)])
            return {"unusable": "%s: %s" % (":".join(owner), error)}

    def create(self, parameters: Any, seed: int, entropy: Any, spawn_key: Any) -> Any:
        """Create a tracker."""

        def sequence() -> Any:
            return np.random.SeedSequence(entropy, spawn_key=tuple(spawn_key))

        self._generators = self._new_generators(seed)
        with self._generators:
            self._tracker = self._rules.create(self._class, parameters, seed, sequence)
        return {"drawn": self._generators.drawn}

    def init(self, pixels: Any, box: Any) -> Any:
        """Initialise the tracker."""
        image, mask = self._read(pixels + [None])[:2]
        init = self._rules.adapt_init(self._tracker.init)
        return self._call(self._tracker, init, image, np.array(box, np.float64), mask)[1]

    def update(self, pixels: Any) -> Any:
        """Return the estimate of the tracker."""
        (image,) = self._read(pixels)
        shape = image.shape
        estimate, reply = self._call(self._tracker, self._tracker.update, image)
        try:
            fields = self._estimates.read_estimate(estimate, shape)
        except self._estimates.MalformedEstimateError as error:
            return {"invalid": str(error)}
        if fields["mask"] is not None:
            (fields["mask"],) = write_arrays(self._frames, [fields["mask"]])
        return dict(reply, estimate=fields)


def libraries() -> Iterator[Any]:
    """Yield the versions of Python and of imported modules that do not belong to Python."""
    yield "python", "%d.%d.%d" % sys.version_info[:3]
    standard = tuple(sysconfig.get_path(key) + os.sep for key in ("stdlib", "platstdlib"))
    for name, module in list(sys.modules.items()):
        if "." in name:  # access to a submodule can print warnings
            continue
        version, path = getattr(module, "__version__", None), getattr(module, "__file__", None)
        if not isinstance(version, str) or not path:
            continue
        installed = "site-packages" in path or "dist-packages" in path
        if installed or not path.startswith(standard):
            yield name, version


def main() -> None:
    """Answer the requests on stdin until it ends."""
    path, home, operations = sys.argv[1:4]
    arguments = sys.argv[4:]
    frames = open(path, "r+b", buffering=0)
    if not operations:
        serve(PlainTrackers(frames, *arguments))
        return
    sys.path[:] = [folder for folder in sys.path if folder != FOLDER]
    if home not in sys.path:
        sys.path.insert(0, home)
    del sys.argv[1:]  # they are not for the files of trackers
    module, _, name = operations.partition(":")
    serve(getattr(importlib.import_module(module), name)(frames, *arguments))


if __name__ == "__main__":
    main()
