"""Fixture that opens `plain/target` with some parameters."""

import pytest

from trackmark.datasets.synthetic import plain


@pytest.fixture(scope="session")
def target():
    """Return a function that opens `plain/target` with parameters."""

    def open_target(**parameters):
        texts = {key: str(value) for key, value in parameters.items()}
        return plain.SUITE.load("plain/target", texts)

    return open_target
