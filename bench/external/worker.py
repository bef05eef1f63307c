"""Run one tracker class of a file in this interpreter, for a harness in another interpreter.

Usage: python worker.py FRAMES FILE [CLASS], or by `start.py`. Needs Python 3.6 or newer and NumPy,
but not trackmark. Each request on stdin, `[number, operation, arguments]`, is one line of JSON. So
is each answer on stdout, `[number, answer]` after `MARK`, with the number of the request. Output of
the tracker goes to stderr. After an exception, the answer is `error` without a number, the
traceback is on stderr, and the process ends. If the tracker forks the process, only the process
that started answers.

| operation and arguments | answer |
|---|---|
| describe | class, name, doc, parameters, randomness, images, libraries |
| create: parameters, seed, entropy, spawn_key | drawn |
| init: pixels, box | wall, cpu, drawn |
| update: pixels | wall, cpu, drawn, estimate; or invalid: the reason why it is not an estimate |

FRAMES is the descriptor of a file with the image of each request, and after it the mask of
`init`. `pixels` is a list of their shapes and types. The mask of an estimate is written to the same
file; `estimate` has its shape and type. `wall` and `cpu` are the times of the tracker's method [s];
`cpu` counts all threads. `drawn` has the names of the global generators that the run has changed.
"""

import faulthandler
import importlib.util
import json
import os
import select
import signal
import sys
import sysconfig
import threading
import traceback
from typing import Any, Iterable

try:
    import numpy as np
except ImportError as error:
    sys.exit("%s cannot import NumPy (%s). Install NumPy there." % (sys.executable, error))


MARK = "@@TRACKMARK:"


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


plain_class = import_rules("plain_class")
estimate_check = import_rules("estimate_check")
call_clock = import_rules("call_clock")
global_generators = import_rules("global_generators")

CLOCK = call_clock.CallClock()


def load(path: str) -> Any:
    """Return the module of a tracker's file."""
    path = os.path.abspath(path)
    sys.path[0] = os.path.dirname(path)  # instead of the folder of this file
    sys.argv = [path]  # those of this process are not for the file
    stem = os.path.splitext(os.path.basename(path))[0]
    # Imports get equal numbers in each process.
    with global_generators.GlobalGenerators(0), plain_class.ForkGuard():
        return import_file(path, "trackmark_plugin_" + stem)


def libraries() -> Any:
    """Return the versions of Python and of imported modules that do not belong to Python."""
    versions = {"python": "%d.%d.%d" % sys.version_info[:3]}
    standard = tuple(sysconfig.get_path(key) + os.sep for key in ("stdlib", "platstdlib"))
    for name, module in list(sys.modules.items()):
        if "." in name:  # access to a submodule can print warnings
            continue
        version, path = getattr(module, "__version__", None), getattr(module, "__file__", None)
        if not isinstance(version, str) or not path:
            continue
        installed = "site-packages" in path or "dist-packages" in path
        if installed or not path.startswith(standard):
            versions[name] = version
    return versions


def create(kind: Any, parameters: Any, seed: int, entropy: Any, spawn_key: Any) -> Any:
    """Return a new tracker."""

    def sequence() -> Any:
        return np.random.SeedSequence(entropy, spawn_key=tuple(spawn_key))

    with plain_class.ForkGuard():
        return plain_class.create(kind, parameters, seed, sequence)


def call(tracker: Any, operation: str, frames: Any, pixels: Any, box: Any = None) -> Any:
    """Return the answer of `init` or `update`."""
    frames.seek(0)
    image, *masks = [read_array(frames, *array) for array in pixels]
    method, arguments = getattr(tracker, operation), [image]
    if operation == "init":
        method = plain_class.adapt_init(method)
        arguments += [np.array(box, np.float64), masks[0] if masks else None]
    with plain_class.ForkGuard():
        CLOCK.start()
        result = method(*arguments)
        call_clock.synchronise(tracker)
        answer = {"time": CLOCK.stop(), "device": call_clock.device_name(tracker)}
    if operation == "update":
        try:
            answer["estimate"] = fields = estimate_check.read_estimate(result, image.shape)
        except estimate_check.MalformedEstimateError as error:
            return {"invalid": str(error)}
        mask = fields["mask"]
        if mask is not None:
            frames.seek(0)
            frames.write(mask.tobytes())
            fields["mask"] = [mask.shape, mask.dtype.str]
    return answer


def read_array(file: Any, shape: Any, dtype: Any) -> Any:
    """Return a new array, because a tracker may keep or modify it."""
    array = np.empty(shape, dtype)
    if file.readinto(array) != array.nbytes:
        raise OSError("the file of frames is too short")
    return array


def respond(requests: Iterable[str], frames: Any, module: Any, name: str) -> Iterable[Any]:
    """Yield number and answer of each request; the class `name` can be empty if there is one."""
    kind = tracker = generators = None  # type: Any
    for line in requests:
        number, operation, arguments = json.loads(line)
        if operation == "describe":
            try:
                kind = plain_class.tracker_class(module, name)
                yield number, dict(plain_class.describe(kind), libraries=libraries())
            except ValueError as error:
                owner = filter(None, [module.__file__, getattr(kind, "__name__", name)])
                yield number, {"unusable": "%s: %s" % (":".join(owner), error)}
        elif operation == "create":
            tracker = None  # releases the memory of the last one first
            generators = global_generators.GlobalGenerators(arguments["seed"])
            with generators:
                tracker = create(kind, **arguments)
            yield number, {"drawn": generators.drawn}
        else:
            with generators:
                answer = call(tracker, operation, frames, **arguments)
            yield number, dict(answer, drawn=generators.drawn)


def end_with_harness(requests: int) -> None:
    """End this process and its children when the harness has ended, also if the tracker hangs."""
    poller = select.poll()
    poller.register(requests, 0)  # reports only that the other end is closed
    poller.poll()
    os.killpg(os.getpgid(0), signal.SIGKILL)


def main() -> None:
    """Answer the requests on stdin until it ends."""
    faulthandler.register(signal.SIGUSR1, all_threads=False)  # if the harness waits too long
    requests, answers = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
    threading.Thread(target=end_with_harness, args=(requests.fileno(),), daemon=True).start()
    descriptor, file = sys.argv[1:3]
    name = "".join(sys.argv[3:])
    frames = os.fdopen(int(descriptor), "r+b", buffering=0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # output of the tracker and of its libraries does not mix with the answers

    def write(number: Any, answer: Any) -> None:
        answers.write(MARK + json.dumps([number, answer], default=repr) + "\n")
        answers.flush()

    try:
        for number, answer in respond(requests, frames, load(file), name):
            write(number, answer)
    except SystemExit:
        raise
    except BaseException as error:
        traceback.print_exc()
        sys.stderr.flush()
        write(None, {"error": traceback.format_exception_only(type(error), error)[-1].strip()})
        os._exit(1)


if __name__ == "__main__":
    main()
