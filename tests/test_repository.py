"""Duplicated code in the packages, and arguments of the CI script."""

import ast
import os
import subprocess
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("bench", "datasets", "reports", "trackers")

LONGEST_COPY = 9
"""Maximum number of consecutive lines of code that occur twice."""


def statements(node):
    """Yield all statements of a syntax tree; `ast.walk` also visits their expressions."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        for child in getattr(node, field, ()):
            yield child
            yield from statements(child)


def code(file):
    """Yield lines of code with their numbers: no blank lines, imports and docstrings."""
    source = file.read_text()
    skipped = set()
    for node in statements(ast.parse(source)):
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if docstring or isinstance(node, ast.Import | ast.ImportFrom):
            skipped |= set(range(node.lineno, node.end_lineno + 1))
    for number, line in enumerate(source.splitlines(), 1):
        if line.strip() and number not in skipped:
            yield number, line.strip()


def test_no_ten_lines_occur_twice():
    places = defaultdict(list)
    for file in sorted(file for package in PACKAGES for file in (ROOT / package).rglob("*.py")):
        lines = list(code(file))
        for start in range(len(lines) - LONGEST_COPY):
            window = tuple(line for _, line in lines[start : start + LONGEST_COPY + 1])
            places[window].append(f"{file.relative_to(ROOT)}:{lines[start][0]}")
    copies = [" = ".join(where) for where in places.values() if len(where) > 1]
    assert not copies, "\n".join(copies)


def test_ci_run_rejects_arguments(tmp_path):
    (tmp_path / "make").write_text("#!/bin/sh\n")
    (tmp_path / "make").chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}"}
    command = [ROOT / ".ci" / "run", "--fast"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 2
    assert (done.stdout, done.stderr.count("\n")) == ("", 1)
    assert "--fast" in done.stderr
    assert "Usage: .ci/run" in done.stderr
