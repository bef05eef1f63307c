"""Specifications of a name with options."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackmark.datasets.spec_string import format_text, parse_text

WORDS = st.text("abcdefghij-_/.0123456789", min_size=1)


@given(name=WORDS, options=st.dictionaries(WORDS, WORDS))
def test_formatted_text_is_parsed_back(name, options):
    assert parse_text(format_text(name, options)) == (name, options)


def test_options_keep_their_order_and_values():
    assert list(parse_text("a:z=1:b=2:m=3")[1]) == ["z", "b", "m"]
    assert parse_text("a:b=c=d:e=") == ("a", {"b": "c=d", "e": ""})


@pytest.mark.parametrize("text", ["a:b", "a:", "a:=3", "a:b=1::c=2"])
def test_option_without_key_or_value_is_refused(text):
    with pytest.raises(ValueError, match=r"is not key=value"):
        parse_text(text)
    with pytest.raises(ValueError, match=r"'b' is given twice"):
        parse_text("a:b=1:b=1")


@pytest.mark.parametrize(
    ("value", "text"),
    [(True, "true"), (False, "false"), (3.0, "3"), (0.25, "0.25"), (1e300, "1e+300"), (7, "7")],
)
def test_values_are_formatted_as_short_as_possible(value, text):
    assert format_text("a", {"k": value}) == f"a:k={text}"
