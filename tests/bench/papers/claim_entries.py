"""Claims with made-up texts, as objects and as entries of files."""

import json
from typing import Any

from trackmark.bench.papers.cases import Names, PaperSequence, PaperTracker
from trackmark.bench.papers.claims import Claim

TEXTS = {
    "source": "Fig. 1",
    "quote": "it tracks",
    "summary": "it tracks",
    "statement": "The target is tracked.",
    "paper": "1 of 1",
    "sequences": "ball",
    "measure": "kept_to_end",
    "falsified_if": "It is lost.",
    "reason": "The figure shows the end.",
}


NAMES = Names(
    "wang2010",
    {name: PaperTracker(name, name, {}) for name in "ABC"},
    {name: PaperSequence(name, "wang2010", (name,)) for name in ("ball", "x", "y")},
)
"""Trackers and sequences that the claims name."""


def claim(**fields: Any) -> Claim:
    """Return a claim with some fields replaced or added."""
    return Claim.model_validate({"name": "AB-1", **TEXTS, **fields}, context=NAMES)


def claim_text(name: str, **fields: Any) -> str:
    """Return a claim as an entry of a claims file."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in {**TEXTS, **fields}.items()]
    return "\n".join([f"[{name}]", *lines, ""])
