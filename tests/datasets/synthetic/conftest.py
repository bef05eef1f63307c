"""Fixture that opens `plain/target` with some parameters."""

import pytest

from trackmark.datasets.synthetic import plain


@pytest.fixture(scope="session")
def target():
    def open_target(**parameters):
        return plain.SUITE.load(
            "plain/target", {key: str(value) for key, value in parameters.items()}
        )

    return open_target
