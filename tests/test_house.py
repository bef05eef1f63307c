"""What keeps the house small enough to be picked up: the length of files and functions, copies."""

import ast
import os
import subprocess
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILES = sorted(
    file
    for package in ("bench", "datasets", "reports", "trackers")
    for file in (ROOT / package).rglob("*.py")
)

PARTS = (ast.stmt, ast.excepthandler, ast.match_case)
"""What statements stand in: expressions hold none."""

LONGEST_FILE = 400
LONGEST_FUNCTION = 60
LONGEST_COPY = 9
"""Lines of code in a row that may stand in two places."""


def name_of(file):
    return file.relative_to(ROOT).as_posix()


@cache
def nodes(file):
    """Statements, and what stands in them that is one."""
    found = [ast.parse(file.read_text())]
    for node in found:
        found += [child for child in ast.iter_child_nodes(node) if isinstance(child, PARTS)]
    return found


def functions(file):
    """Functions but for compiled kernels, into which what they call is written by hand."""
    for node in nodes(file):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            decorators = map(ast.unparse, node.decorator_list)
            if not any("njit" in decorator for decorator in decorators):
                yield node


def too_long():
    for file in FILES:
        source = file.read_text()
        if source.count("\n") > LONGEST_FILE:
            yield name_of(file)
        for function in functions(file):
            if function.end_lineno - function.lineno >= LONGEST_FUNCTION:
                yield f"{name_of(file)}: {function.name}"


def test_no_file_and_no_function_is_too_long():
    assert not list(too_long())


def code(file):
    """Lines of code with their numbers: without blank lines, imports and docstrings."""
    source = file.read_text()
    skipped = set()
    for node in nodes(file):
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if docstring or isinstance(node, ast.Import | ast.ImportFrom):
            skipped |= set(range(node.lineno, node.end_lineno + 1))
    for number, line in enumerate(source.splitlines(), 1):
        if line.strip() and number not in skipped:
            yield number, line.strip()


def test_no_ten_lines_stand_twice():
    places = defaultdict(list)
    for file in FILES:
        lines = list(code(file))
        for start in range(len(lines) - LONGEST_COPY):
            window = tuple(line for _, line in lines[start : start + LONGEST_COPY + 1])
            places[window].append(f"{name_of(file)}:{lines[start][0]}")
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
