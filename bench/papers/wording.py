"""Trackers, settings and values as a paper's tables and figures tell them."""

from collections.abc import Collection
from typing import Any

import pandas as pd

from bench.experiments.contestant import contestant
from bench.papers.description import Description
from datasets.text_form import format_text, parse_text
from reports.tables import MISSING

__all__ = ["Wording"]

POST_HOC = " (post hoc)"


class Wording:
    """Words of a paper's `[names]` and `[settings]`."""

    def __init__(self, description: Description) -> None:
        self._names = description.names
        self._told = description.settings.told
        self._post_hoc = [_pairs(text) for text in description.settings.post_hoc]
        self._together = [
            (_pairs(text), words) for text, words in self._names.items() if "=" in text
        ]

    def of(self, name: Any) -> str:
        """Words of a tracker, a sequence or a value; a sequence's name without its suite."""
        text = MISSING if name in (0, "") or pd.isna(name) else str(name)
        return self._names.get(text, text.partition("/")[2] or text)

    def setting(self, text: str, without: Collection[str] = ()) -> str:
        """How a tracker was run: what its text form says, and what the paper always tells of it.

        `without` are parameters that stand elsewhere.
        """
        name, options = parse_text(text)
        told = {key: self._value(text, key) for key in self._told.get(name, ())}
        told |= options
        left = {key: value for key, value in told.items() if key not in without}
        words = []
        for pairs, together in self._together:
            if pairs.items() <= {**left, "": name}.items():
                words.append((min(list(left).index(k) for k in pairs if k), together, pairs))
                left = {k: "" if k in pairs else v for k, v in left.items()}
        for place, (key, value) in enumerate(left.items()):
            if value:
                words.append((place, value if key == "preset" else f"{key}={value}", {key: value}))
        marked = [
            f"{told_as}{POST_HOC if self._is_post_hoc(name, pairs) else ''}"
            for _, told_as, pairs in sorted(words, key=lambda word: word[0])
        ]
        return ", ".join(marked) or MISSING

    def _is_post_hoc(self, name: str, pairs: dict[str, str]) -> bool:
        return any(
            one.items() <= {**pairs, "": name}.items() or one == pairs for one in self._post_hoc
        )

    def _value(self, text: str, key: str) -> str:
        settled = contestant(text)
        value = settled.preset if key == "preset" else settled.parameters[key]
        return format_text("", {key: value}).rpartition("=")[2]


def _pairs(text: str) -> dict[str, str]:
    """A text form's options, its tracker's name (if there is one) under an empty key."""
    name, options = parse_text(f":{text}" if "=" in text.partition(":")[0] else text)
    return options | ({"": name} if name else {})
