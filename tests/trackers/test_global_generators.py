"""Global random generators: a state per run, names of the used ones, and restoration."""

# ruff: noqa: NPY002  # the legacy generator of NumPy is tested

import ctypes
import random
import sys
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from trackmark.trackers.base.global_generators import GlobalGenerators, preserved_generators


def opencv():
    number = np.zeros((1, 1))
    cv2.randn(number, 0, 1)
    return number.item()


DRAWS = {
    "random": lambda: random.gauss(0, 1),
    "numpy.random": lambda: np.random.normal(),  # caches every second number
    "OpenCV": opencv,
    "rand of C": lambda: ctypes.CDLL(None).rand(),
    "PyTorch": lambda: sys.modules["torch"].draw(),
}


@pytest.fixture
def torch(monkeypatch):
    """Provide a stand-in for PyTorch."""
    generator = random.Random(1)
    module = SimpleNamespace(
        manual_seed=generator.seed,
        get_rng_state=generator.getstate,
        set_rng_state=generator.setstate,
        draw=generator.random,
    )
    monkeypatch.setitem(sys.modules, "torch", module)
    return module


@pytest.fixture(autouse=True)
def preserved():
    with preserved_generators():
        yield


def numbers(draw, seed, others=()):
    """Return a number from each of 700 calls of a run, between calls of other runs."""
    generators, drawn = GlobalGenerators(seed), []
    for call in range(700):  # more than the 624 words of a state
        for other in others:
            with other:
                for _ in range(call % 3):
                    draw()
        with generators:
            drawn.append(draw())
    return drawn


@pytest.mark.parametrize("name", DRAWS)
def test_equal_seeds_give_equal_numbers_in_lock_step(torch, name):
    alone = numbers(DRAWS[name], 5)
    others = [GlobalGenerators(5), GlobalGenerators(6)]
    assert numbers(DRAWS[name], 5, others) == alone
    assert numbers(DRAWS[name], 6)[:9] != alone[:9]
    assert len(set(alone)) > 690


@pytest.mark.parametrize("name", DRAWS)
def test_generator_that_was_drawn_from_is_named(torch, name):
    generators = GlobalGenerators(5)
    for draw in (int, DRAWS[name], int):
        with generators:
            draw()
    assert generators.drawn == [name]


def test_numbers_after_the_seed_of_a_tracker_are_kept():
    def draw():
        return np.random.normal(), random.random(), random.gauss(0, 1)

    np.random.seed(7)
    random.seed(7)
    expected = [draw() for _ in range(700)]
    generators, other = GlobalGenerators(0), GlobalGenerators(1)
    with generators:
        pass
    with generators:
        np.random.seed(7)
        random.seed(7)
    actual = []
    for _ in range(700):
        with other:
            draw()
        with generators:
            actual.append(draw())
    assert actual == expected


def test_replaced_algorithm_of_numpy_is_kept_and_restored():
    before, state = np.random.get_bit_generator(), np.random.get_state()
    expected = np.random.PCG64(3).random_raw(2).tolist()
    generators, other = GlobalGenerators(0), GlobalGenerators(1)
    with preserved_generators():
        with generators:
            np.random.set_bit_generator(np.random.PCG64(3))
        actual = []
        for _ in expected:
            with other:
                np.random.normal()
            with generators:
                actual.append(np.random.get_bit_generator().random_raw())
    assert actual == expected
    assert np.random.get_bit_generator() is before
    assert np.array_equal(np.random.get_state()[1], state[1])


def test_other_algorithm_of_the_session_does_not_count():
    expected = numbers(np.random.normal, 5)
    before = np.random.get_bit_generator()
    np.random.set_bit_generator(np.random.PCG64(3))
    try:
        with preserved_generators():
            assert numbers(np.random.normal, 5) == expected
        assert type(np.random.get_bit_generator()) is np.random.PCG64
    finally:
        np.random.set_bit_generator(before)


@pytest.mark.parametrize("name", DRAWS)
def test_state_before_the_runs_is_restored(torch, name):
    draw, values = DRAWS[name], []
    for _ in range(2):
        random.seed(9)
        np.random.seed(9)
        cv2.setRNGSeed(9)
        ctypes.CDLL(None).srand(9)
        torch.manual_seed(9)
        with preserved_generators():
            numbers(draw, len(values))
        values.append(draw())
    assert values[0] == values[1]


def test_seed_set_while_torch_is_imported_is_kept(torch, monkeypatch):
    monkeypatch.delitem(sys.modules, "torch")
    torch.initial_seed = lambda: 3
    generators = GlobalGenerators(0)
    with generators:
        monkeypatch.setitem(sys.modules, "torch", torch)
        torch.manual_seed(3)
    with generators:
        assert torch.draw() == random.Random(3).random()
    assert generators.drawn == ["PyTorch"]
