"""Claims with made-up texts, as objects and as files."""

import json
from pathlib import Path
from typing import Any

from bench.claims.claims_file import Claim

TEXTS = {
    "source": "Fig. 1",
    "quote": "it tracks",
    "short": "it tracks",
    "says": "The target is tracked.",
    "paper": "1 of 1",
    "sequences": "ball",
    "measure": "kept",
    "falsified": "It is lost.",
    "reason": "The figure shows the end.",
}


def claim(**fields: Any) -> Claim:
    """Return a claim with some fields replaced or added."""
    return Claim.model_validate({"name": "AB-1", **TEXTS, **fields})


def write_claim(folder: Path, **fields: Any) -> Path:
    """Write a claims file with one claim."""
    path = folder / "claims.toml"
    lines = [f"{name} = {json.dumps(field)}" for name, field in {**TEXTS, **fields}.items()]
    path.write_text("\n".join(["[AB-1]", *lines]), "utf-8")
    return path
