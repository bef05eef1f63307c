"""Global random generators of a process: seeded for each run, and noticed if a tracker draws.

Trackers in lock step share the generators of `random`, NumPy, OpenCV, the C library and PyTorch.
`GlobalGenerators` gives each run a state of its own, which is set before each call of its tracker.
`bench/external/worker.py` loads this file into interpreters of users. It therefore has the syntax
of Python 3.6, and needs NumPy only.
"""

import ctypes
import random
import sys
from contextlib import contextmanager
from typing import Any, Iterator, List

import numpy as np

_TORCH_SEED = 67280421310721  # seed of PyTorch before anything has set another one


class GlobalGenerators:
    """Context of each call of a tracker: the generators have the state of its run.

    Equal seeds give equal numbers, independent of other runs in the process. The state is that
    after the last call of the run. In the first call, the generators are seeded. The generators of
    OpenCV and C cannot return their state, so they get another seed in each call. Each thread has
    a generator of OpenCV: only that of the calling thread is seeded. PyTorch is seeded if it was
    imported before the call.
    """

    def __init__(self, seed: int) -> None:
        kinds = [_Python, _NumPy, _OpenCV, _C, _Torch]  # type: List[Any]
        self._generators = [kind(seed) for kind in kinds]

    @property
    def drawn(self) -> List[str]:
        """Names of the generators that the tracker has changed."""
        return [generator.name for generator in self._generators if generator.drawn]

    def __enter__(self) -> None:
        for generator in self._generators:
            generator.install()

    def __exit__(self, *_: object) -> None:
        for generator in self._generators:
            generator.store()


@contextmanager
def preserved_generators() -> Iterator[None]:
    """Restore the state of the global generators at the end of the context.

    The generators of OpenCV and C cannot return their state. They continue with a seed that they
    have drawn themselves.
    """
    python, numpy_bits, numpy_state = random.getstate(), _bit_generator(), _numpy_state()
    reseeded = [kind(0) for kind in (_OpenCV, _C)]
    seeds = [generator.draw() for generator in reseeded]
    torch = _Torch(0)
    torch.keep()
    try:
        yield
    finally:
        random.setstate(python)
        _restore_numpy(numpy_bits, numpy_state)
        for generator, seed in zip(reseeded, seeds):
            generator.seed(seed)
        torch.restore()


class _Python:
    """Generator of the module `random`.

    While a tracker has not drawn, one number is drawn after each of its calls. It differs from the
    first number of the seed if the tracker has drawn. This takes 3 µs; to compare states, 15 µs.
    """

    name = "random"

    def __init__(self, seed: int) -> None:
        self.drawn = False
        generator = random.Random(seed)
        self._state = generator.getstate()
        self._first = generator.getrandbits(32)

    def install(self) -> None:
        random.setstate(self._state)

    def store(self) -> None:
        if self.drawn:
            self._state = random.getstate()
        elif random.getrandbits(32) != self._first:
            self.drawn = True
            # The generator is a buffer of words: put the drawn word back.
            version, state_words, gauss = random.getstate()
            self._state = version, state_words[:-1] + (state_words[-1] - 1,), gauss


class _NumPy:
    """Legacy generator of NumPy; see `_Python`. To seed it takes 2 µs, to read its state 30 µs."""

    name = "numpy.random"

    def __init__(self, seed: int) -> None:
        self.drawn = False
        self._seed = seed
        self._bits = _bit_generator()
        if self._bits is not None and type(self._bits).__name__ != "MT19937":
            self._bits = np.random.MT19937()  # the user's session has replaced the algorithm
        self._state = None  # type: Any
        self._first = None  # type: Any

    def install(self) -> None:
        _restore_numpy(self._bits, self._state)
        if self.drawn:
            return
        np.random.seed(self._seed)
        if self._first is None:
            self._first = _numpy_word()
            np.random.seed(self._seed)

    def store(self) -> None:
        if not self.drawn:
            if _bit_generator() is self._bits:
                if _numpy_word() == self._first:
                    return
                name, key, position, has_gauss, gauss = _numpy_state()
                np.random.set_state((name, key, position - 1, has_gauss, gauss))
            self.drawn = True
        self._bits, self._state = _bit_generator(), _numpy_state()


def _bit_generator() -> Any:
    """Return the object with the state of NumPy's generator; None before NumPy 1.24."""
    get = getattr(np.random, "get_bit_generator", None)
    return get() if get else None


def _numpy_word() -> int:
    """Return 32 bits of NumPy's generator."""
    bits = _bit_generator()
    if bits is None:
        return int(np.random.randint(0, 1 << 32, dtype=np.uint32))
    return int(bits.random_raw())


def _numpy_state() -> Any:
    """Return the state of NumPy's generator; None if a tracker has replaced its algorithm."""
    bits = _bit_generator()
    if bits is not None and type(bits).__name__ != "MT19937":
        return None  # the object itself keeps the state
    return np.random.get_state()


def _restore_numpy(bits: Any, state: Any) -> None:
    legacy = np.random  # type: Any
    if bits is not None and bits is not _bit_generator():
        legacy.set_bit_generator(bits)
    if state is not None:
        legacy.set_state(state)


class _Reseeded:
    """Generator without readable state, which is seeded before each call of a tracker.

    While the tracker has not drawn, the seed is always the same one, and a number that is drawn
    after the call is the first one of this seed. Afterwards, each call has another seed.
    """

    name = ""

    def __init__(self, seed: int) -> None:
        self.drawn = False
        self._seeds = random.Random(seed)
        self._seed = self._next_seed()
        self._first = None  # type: Any

    def install(self) -> None:
        if self.drawn:
            self._seed = self._next_seed()
        elif self._first is None:
            self.seed(self._seed)
            self._first = self.draw()
        self.seed(self._seed)

    def _next_seed(self) -> int:
        # OpenCV takes the bits of the seed as its first number: they must include the sign.
        return self._seeds.getrandbits(32) - (1 << 31)

    def store(self) -> None:
        # After the import of a library in this call, there is no number to compare with.
        if not self.drawn and self._first is not None:
            self.drawn = self.draw() != self._first

    def seed(self, seed: Any) -> None:
        """Set the seed; do nothing without the library."""
        raise NotImplementedError

    def draw(self) -> Any:
        """Return an integer, which is a valid seed; None without the library."""
        raise NotImplementedError


class _OpenCV(_Reseeded):
    """OpenCV's generator of the current thread."""

    name = "OpenCV"

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._drawn = np.zeros((1, 1), np.int32)

    def seed(self, seed: Any) -> None:
        cv2 = sys.modules.get("cv2")  # type: Any
        if seed is not None and hasattr(cv2, "setRNGSeed"):
            cv2.setRNGSeed(seed)

    def draw(self) -> Any:
        cv2 = sys.modules.get("cv2")  # type: Any
        if not hasattr(cv2, "setRNGSeed"):
            return None
        cv2.randu(self._drawn, -(1 << 31), 1 << 31)
        return self._drawn.item()


try:
    _LIBC = ctypes.CDLL(None)  # type: Any
except TypeError:  # Windows
    _LIBC = None


class _C(_Reseeded):
    """The function `rand` of C, which OpenCV's MIL and Boosting use, too."""

    name = "rand of C"

    def seed(self, seed: Any) -> None:
        if _LIBC is not None:
            _LIBC.srand(ctypes.c_uint(seed & 0xFFFFFFFF))

    def draw(self) -> Any:
        return _LIBC.rand() if _LIBC is not None else None


class _Torch:
    """PyTorch's generators of the processor and, if they are in use, of CUDA."""

    name = "PyTorch"

    def __init__(self, seed: int) -> None:
        self.drawn = False
        self._seed = seed
        self._states = None  # type: Any

    def install(self) -> None:
        torch = _torch()
        if torch is None:
            return
        if self._states is None:
            torch.manual_seed(self._seed)
            self._states = _torch_states(torch)
        else:
            self.restore()

    def store(self) -> None:
        torch = _torch()
        if torch is None:
            return
        if self._states is None:  # imported in this call
            if getattr(torch, "initial_seed", lambda: _TORCH_SEED)() == _TORCH_SEED:
                return  # seeded before the next call
            self.drawn = True  # the tracker has set a seed
        states = _torch_states(torch)
        self.drawn = self.drawn or not _equal(states, self._states)
        self._states = states

    def keep(self) -> None:
        """Keep the current states for `restore`."""
        torch = _torch()
        self._states = _torch_states(torch) if torch is not None else None

    def restore(self) -> None:
        """Set the kept states."""
        torch = _torch()
        if torch is None or self._states is None:
            return
        processor, devices = self._states
        torch.set_rng_state(processor)
        if devices:
            torch.cuda.set_rng_state_all(devices)


def _torch() -> Any:
    """Return PyTorch if it is imported; otherwise None."""
    torch = sys.modules.get("torch")  # type: Any
    return torch if hasattr(torch, "set_rng_state") else None


def _torch_states(torch: Any) -> Any:
    """Return the state of the processor and a list of those of the devices in use."""
    cuda = getattr(torch, "cuda", None)  # type: Any
    in_use = getattr(cuda, "is_initialized", lambda: False)()
    return torch.get_rng_state(), list(cuda.get_rng_state_all()) if in_use else []


def _equal(states: Any, other_states: Any) -> bool:
    """Return whether states of PyTorch are equal; devices that were not in use before count."""
    (processor, devices), (other, other_devices) = states, other_states
    pairs = [(processor, other)] + list(zip(devices, other_devices))
    return len(devices) == len(other_devices) and all(map(_same, *zip(*pairs)))


def _same(state: Any, other: Any) -> bool:
    equal = state == other
    return bool(equal.all() if hasattr(equal, "all") else equal)
