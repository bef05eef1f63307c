"""Compiled kernels that call one another stand in one file.

Numba's cache on disk notices a change of a kernel's own file only: a kernel that calls one of
another file would go on running the old code, while the version of its tracker says that it is
new.
"""

import importlib
import pkgutil
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

from trackmark import datasets, trackers


def modules(package: ModuleType) -> list[str]:
    found = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    return [
        module.name for module in found if not module.name.startswith("trackmark.trackers.opencv_")
    ]


@pytest.mark.parametrize("name", modules(trackers) + modules(datasets))
def test_a_kernel_calls_only_kernels_of_its_own_file(name):
    module = importlib.import_module(name)
    kernels = [value for value in vars(module).values() if isinstance(value, Dispatcher)]
    own = [kernel for kernel in kernels if kernel.py_func.__module__ == name]
    for kernel in own:
        called = (vars(module).get(used) for used in kernel.py_func.__code__.co_names)
        foreign = [
            used.py_func.__name__
            for used in called
            if isinstance(used, Dispatcher) and used.py_func.__module__ != name
        ]
        assert not foreign, f"{kernel.py_func.__name__} calls {foreign} of another file"
