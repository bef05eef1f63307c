"""Claims with made-up texts, as objects and as files."""

import json
from pathlib import Path
from typing import Any

from trackmark.bench.claims.claims_file import Claim

TEXTS = {
    "source": "Fig. 1",
    "quote": "it tracks",
    "short": "it tracks",
    "statement": "The target is tracked.",
    "paper": "1 of 1",
    "sequences": "ball",
    "measure": "kept",
    "falsified": "It is lost.",
    "reason": "The figure shows the end.",
}


def claim(**fields: Any) -> Claim:
    """Return a claim with some fields replaced or added."""
    return Claim.model_validate({"name": "AB-1", **TEXTS, **fields})


def claim_text(name: str, **fields: Any) -> str:
    """Return a claim as an entry of a claims file."""
    lines = [f"{key} = {json.dumps(value)}" for key, value in {**TEXTS, **fields}.items()]
    return "\n".join([f"[{name}]", *lines, ""])


def write_claim(folder: Path, **fields: Any) -> Path:
    """Write a claims file with one claim."""
    path = folder / "claims.toml"
    path.write_text(claim_text("AB-1", **fields), "utf-8")
    return path
