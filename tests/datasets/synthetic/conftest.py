"""Fixture that opens `plain/target` with some parameters."""

import pytest

from trackmark.datasets.synthetic import plain


@pytest.fixture(scope="session")
def target():
    def open_target(**knobs):
        return plain.SUITE.load("plain/target", {key: str(value) for key, value in knobs.items()})

    return open_target
