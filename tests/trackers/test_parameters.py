"""Parameters: text accepted, bounds checked, one clear line for what is wrong."""

from typing import Literal

import pytest
from pydantic import Field

from trackmark.trackers.base.parameters import Parameters, TrackerError


class Example(Parameters):
    count: int = Field(32, ge=1, le=254, description="how many [count]")
    radius: float = Field(2.0, ge=0, description="how far [pixels]")
    adapt: bool = Field(default=True, description="whether it adapts")
    window: Literal["fixed", "adaptive"] = Field("fixed", description="which window")


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("count", "16", 16),
        ("radius", "3", 3.0),
        ("radius", "1e-3", 0.001),
        ("adapt", "false", False),
        ("adapt", "True", True),
        ("window", "adaptive", "adaptive"),
    ],
)
def test_text_from_the_command_line_becomes_the_declared_type(name, text, value):
    actual = getattr(Example.checked("example", {name: text}), name)
    assert actual == value
    assert type(actual) is type(value)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("count", "0", "example: parameter count=0: .*greater than or equal to 1"),
        ("count", 255, "example: parameter count=255: .*less than or equal to 254"),
        ("count", "2.5", "example: parameter count=2.5: .*integer"),
        ("count", "many", "example: parameter count=many: .*integer"),
        ("radius", "nan", "example: parameter radius=nan: .*finite"),
        ("radius", float("inf"), "example: parameter radius=inf: .*finite"),
        ("adapt", "perhaps", "example: parameter adapt=perhaps: .*boolean"),
        ("window", "fixd", "example: parameter window=fixd: .*'fixed' or 'adaptive'"),
    ],
)
def test_invalid_value_error_names_owner_and_bounds(name, value, message):
    with pytest.raises(TrackerError, match=message) as caught:
        Example.checked("example", {name: value})
    assert "\n" not in str(caught.value)


def test_an_unknown_parameter_lists_the_known_and_the_closest():
    with pytest.raises(TrackerError) as caught:
        Example.checked("example", {"cuont": 3})
    assert str(caught.value) == (
        "unknown parameter of example 'cuont'. Did you mean 'count'? "
        "Known: adapt, count, radius, window."
    )


def test_a_tracker_without_parameters_says_so():
    with pytest.raises(TrackerError, match="Known: none"):
        Parameters.checked("static", {"speed": 1})
