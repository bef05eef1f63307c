"""Compiled kernels that call one another are in one file.

Numba's cache on disk notices changes only in a kernel's own file. A kernel that calls one of
another file would run old code, although the version of its tracker is new.
"""

import importlib
import pkgutil
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

from trackmark import datasets, trackers


def module_names(package: ModuleType) -> list[str]:
    modules = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    return [
        module.name
        for module in modules
        if not module.name.startswith("trackmark.trackers.opencv_")
    ]


@pytest.mark.parametrize("name", module_names(trackers) + module_names(datasets))
def test_kernel_calls_only_kernels_of_its_file(name):
    module = importlib.import_module(name)
    kernels = [value for value in vars(module).values() if isinstance(value, Dispatcher)]
    defined_here = [kernel for kernel in kernels if kernel.py_func.__module__ == name]
    for kernel in defined_here:
        called = (vars(module).get(used) for used in kernel.py_func.__code__.co_names)
        foreign = [
            used.py_func.__name__
            for used in called
            if isinstance(used, Dispatcher) and used.py_func.__module__ != name
        ]
        assert not foreign, f"{kernel.py_func.__name__} calls {foreign} of another file"
