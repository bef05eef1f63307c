"""Run one tracker class of a file in this interpreter, for a harness in another interpreter.

Usage: python worker.py FRAMES FILE [CLASS]. Needs Python 3.6 or newer and NumPy, but not trackmark.
Each request on stdin and each answer on stdout is one line of JSON; output of the tracker goes to
stderr. After an exception, the answer is `error`, the traceback is on stderr, and the process ends.

| request `op` and arguments | answer |
|---|---|
| describe | class, doc, parameters, randomness, libraries, methods, ... |
| create: parameters, seed, entropy, spawn_key | |
| watch: shape | wall, cpu |
| init: shape, box, mask | wall, cpu |
| update: shape | wall, cpu, estimate: the returned value |
| finish | wall, cpu, revised |

FRAMES is the descriptor of a file with the image of each request: BGR bytes of the shape `shape`.
A mask is a list: height, width, and its packed bits in base64. `wall` and `cpu` are the times of
the tracker's method [s]; `cpu` counts all threads.
"""

import base64
import faulthandler
import importlib.util
import inspect
import json
import math
import os
import random
import select
import signal
import sys
import sysconfig
import threading
import time
import traceback
from typing import Any, Iterable

import numpy as np

RANDOM = ("seed", "rng")  # arguments of `__init__` that are not parameters
FIELDS = ("box", "visible", "confidence", "mask", "details", "revised")  # of an estimate


def load(path: str, name: str) -> Any:
    """Return the tracker class of a file; `name` can be empty if there is only one."""
    path = os.path.abspath(path)
    sys.path[0] = os.path.dirname(path)  # instead of the folder of this file
    stem = os.path.splitext(os.path.basename(path))[0]
    spec = importlib.util.spec_from_file_location("trackmark_plugin_" + stem, path)  # type: Any
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    if name:
        return getattr(module, name)
    classes = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and value.__module__ == spec.name
        and callable(getattr(value, "init", None))
        and callable(getattr(value, "update", None))
        and not inspect.isabstract(value)
    ]
    classes = [value for value in classes if is_plugin(value)] or classes
    exported = [c for c in classes if c.__name__ in getattr(module, "__all__", [c.__name__])]
    if len(exported) != 1:
        names = ", ".join(value.__name__ for value in classes) or "none"
        raise ValueError(
            "%s: expected one class with the methods init(image, box) and update(image), but the "
            "file defines: %s. Select one, for example %s:CLASS." % (path, names, path)
        )
    return exported[0]


def is_plugin(kind: Any) -> bool:
    """Return whether a class derives from `TrackerPlugin` of trackmark."""
    return any(base.__name__ == "TrackerPlugin" for base in kind.__mro__)


def arguments_of(kind: Any) -> Any:
    """Return the arguments of a class by name."""
    return inspect.signature(kind).parameters


def describe(kind: Any) -> Any:
    """Return the description of a tracker class."""
    name = getattr(kind, "name", "")  # it can be a property
    description = {"class": kind.__name__, "doc": kind.__doc__ or ""}  # type: Any
    description["name"] = name if isinstance(name, str) else ""
    if is_plugin(kind):
        for key in ("paper", "presets", "default_preset"):
            if hasattr(kind, key):
                description[key] = getattr(kind, key)
        fields = kind.Parameters.model_fields
        defaults = {
            key: field.get_default(call_default_factory=True) for key, field in fields.items()
        }
        randomness = kind.randomness
    else:
        defaults = {}
        for argument in arguments_of(kind).values():
            variable = argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD)
            if argument.name in RANDOM or variable:
                continue
            if argument.default is argument.empty:
                raise TypeError(
                    "the argument %r of %s has no default. Expected: defaults for all arguments "
                    "except seed and rng." % (argument.name, kind.__name__)
                )
            defaults[argument.name] = argument.default
            if type(argument.default) is int and argument.annotation in (float, "float"):
                defaults[argument.name] = float(argument.default)
        drawn = any(name in arguments_of(kind) for name in RANDOM)
        randomness = getattr(kind, "randomness", "generator" if drawn else "none")
    description["parameters"] = {
        key: value
        for key, value in defaults.items()
        if type(value) in (bool, int, str) or (type(value) is float and math.isfinite(value))
        if not key.startswith("_")
    }
    description["randomness"] = getattr(randomness, "value", randomness)
    description["libraries"] = libraries()
    description["methods"] = [m for m in ("watch", "finish") if callable(getattr(kind, m, None))]
    return description


def libraries() -> Any:
    """Return the versions of Python and of imported modules that do not belong to Python."""
    versions = {"python": "%d.%d.%d" % sys.version_info[:3]}
    standard = tuple(sysconfig.get_path(key) + os.sep for key in ("stdlib", "platstdlib"))
    for name, module in list(sys.modules.items()):
        version, path = getattr(module, "__version__", None), getattr(module, "__file__", None)
        if "." in name or not isinstance(version, str) or not path:
            continue
        installed = "site-packages" in path or "dist-packages" in path
        if installed or not path.startswith(standard):
            versions[name] = version
    return versions


def create(kind: Any, request: Any) -> Any:
    """Return a new tracker; the global random generators are seeded."""
    parameters, seed = request["parameters"], request["seed"]
    # Code of users often draws from the global generators, which then repeat with the run.
    random.seed(seed)
    np.random.seed(seed)

    def sequence() -> Any:
        return np.random.SeedSequence(request["entropy"], spawn_key=tuple(request["spawn_key"]))

    if is_plugin(kind):
        return kind(kind.Parameters(**parameters), sequence())
    if "seed" in arguments_of(kind):
        parameters["seed"] = seed
    if "rng" in arguments_of(kind):
        parameters["rng"] = np.random.default_rng(sequence())
    return kind(**parameters)


def init_arguments(tracker: Any, box: Any, mask: Any) -> Any:
    """Return the arguments of `init` after the image: with the mask if `init` accepts it."""
    box = np.array(box, np.float64)
    signature = inspect.signature(tracker.init)
    argument = signature.parameters.get("mask")
    if argument is not None and argument.kind is not argument.POSITIONAL_ONLY:
        return (box,), {"mask": mask}
    try:
        signature.bind(None, None, None)
    except TypeError:
        return (box,), {}
    return (box, mask), {}


def estimate_fields(answer: Any) -> Any:
    """Return the value that `update` returned, with the fields of an object as a dict."""
    if hasattr(answer, "box"):
        answer = {key: getattr(answer, key) for key in FIELDS if hasattr(answer, key)}
    elif hasattr(answer, "__array__"):
        answer = {"box": answer}  # as a list, two rows would be a box and a confidence
    if isinstance(answer, dict):
        answer = {key: value for key, value in answer.items() if key != "arrays"}
        if answer.get("mask") is not None:
            answer["mask"] = pack(np.asarray(answer["mask"]))
        if answer.get("revised"):
            answer["revised"] = revised_fields(answer["revised"])
    return answer


def to_json(value: Any) -> Any:
    """Return an array or a number of NumPy or of another library as JSON."""
    return np.asarray(value, np.float64).tolist()


def revised_fields(revised: Any) -> Any:
    """Return corrected boxes as JSON."""
    return [[int(frame), np.asarray(box).tolist()] for frame, box in revised.items()]


def pack(mask: Any) -> Any:
    """Return a mask as JSON."""
    if mask.dtype != np.bool_ or mask.ndim != 2:
        raise ValueError(
            "the mask is %s of shape %s. Expected: bool of the image's shape"
            % (mask.dtype, mask.shape)
        )
    bits = base64.b64encode(np.packbits(mask).tobytes()).decode("ascii")
    return [mask.shape[0], mask.shape[1], bits]


def unpack(height: int, width: int, bits: str) -> Any:
    """Return the mask of `pack`."""
    pixels = np.unpackbits(np.frombuffer(base64.b64decode(bits), np.uint8))[: height * width]
    return pixels.reshape(height, width).astype(np.bool_)


def read_image(file: Any, shape: Any) -> Any:
    """Return a new array, because a tracker may keep or modify it."""
    image = np.empty(shape, np.uint8)
    file.seek(0)
    if file.readinto(image) != image.nbytes:
        raise OSError("the file of frames is too short")
    return image


def respond(requests: Iterable[str], frames: Any, kind: Any) -> Iterable[Any]:
    """Yield the answer to each request."""
    tracker = None  # type: Any
    for line in requests:
        request = json.loads(line)
        operation = request["op"]
        if operation == "describe":
            yield describe(kind)
            continue
        if operation == "create":
            tracker = None  # releases the memory of the last one first
            tracker = create(kind, request)
            yield {}
            continue
        method, keywords = getattr(tracker, operation), {}
        arguments = ()  # type: Any
        if operation == "init":
            mask = unpack(*request["mask"]) if request["mask"] else None
            arguments, keywords = init_arguments(tracker, request["box"], mask)
        if operation != "finish":
            arguments = (read_image(frames, request["shape"]),) + arguments
        wall, cpu = time.perf_counter(), time.process_time()
        result = method(*arguments, **keywords)
        answer = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        if operation == "update":
            answer["estimate"] = estimate_fields(result)
        elif operation == "finish":
            answer["revised"] = revised_fields(result)
        yield answer


def end_with_harness(requests: int) -> None:
    """End this process and its children when the harness has ended, also if the tracker hangs."""
    poller = select.poll()
    poller.register(requests, 0)  # reports only that the other end is closed
    poller.poll()
    os.killpg(os.getpgid(0), signal.SIGKILL)


def main() -> None:
    """Answer the requests on stdin until it ends."""
    faulthandler.register(signal.SIGUSR1)  # writes the stack if the harness waits too long
    requests, answers = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
    threading.Thread(target=end_with_harness, args=(requests.fileno(),), daemon=True).start()
    frames = os.fdopen(int(sys.argv[1]), "rb", buffering=0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # output of the tracker and of its libraries does not mix with the answers

    def write(answer: Any) -> None:
        answers.write(json.dumps(answer, default=to_json) + "\n")
        answers.flush()

    try:
        kind = load(sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else "")
        for answer in respond(requests, frames, kind):
            write(answer)
    except SystemExit:
        raise
    except BaseException as error:
        traceback.print_exc()
        sys.stderr.flush()
        write({"error": traceback.format_exception_only(type(error), error)[-1].strip()})
        os._exit(1)


if __name__ == "__main__":
    main()
