"""Docstrings, names, messages and pages follow the section "Style" of CONTRIBUTING.md."""

import ast
import re
from inspect import cleandoc
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("bench", "datasets", "reports", "tests", "trackers")
CODE = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.py"))]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])

OPENINGS = (
    "Of|What|Whether|How|Where|Who|Whom|Whose|Which|When|As|By|In|For|To|From|That|Those|These|It|"
    "They|Such|Somebody|Nobody|Everything|Nothing|Likewise|Is|Are|Has|Takes? notice|The same"
)
BANNED = (
    "told|tells? of|anew|mend(?:s|ed|ing)?|whom|astray|culprits?|innocents?|somebody|nobody|"
    "hereafter|thereof|by halves|found wanting|sa(?:ys|id) of|what lacks|for ever|beside|"
    "older sel(?:f|ves)|be it|as ever|on end|misdeeds?|begun again|what is (?:there|left|asked)|"
    "can't be told|goes by|bears?|alike|whatever|whoever"
)
WEAK_NAMES = (
    "found|told|said|known|there|here|shown|asked|given|one|ones|those|what|who|of|own|at|by|begun|"
    "made|taken|kept|lacking|guests"
)
PRIVATE_WORDS = {
    "filed": "protocol_key",
    "knob": "difficulty, or parameter",
    "footage": "frames, or encoded_frames",
    "filmed": "with_frames",
    "performer": "executor",
    "worn": "the fact, for example failed",
    "complain": "print_error",
    "patience": "report_slow_work",
    "outlet": "SafeStream",
    "circumstances": "metadata",
    "surroundings": "environment",
    "contender": "is_unbeaten",
    "lacking": "missing_reason",
    "pace": "speed_change",
    "sized": "collections.abc.Sequence",
    "its": "the name of the owner",
    "why": "reason",
    "walk": "sequence_pass",
}
"""Words that no reader knows in this sense, as a part of a name, and what to call it instead."""

MAX_WORDS = {"page": 30, "docstring": 35, "message": 10**6}  # of a sentence


def sentences(text):
    """Yield sentences without code, tables, headings and addresses of links."""
    code = r"^```.*?^```$|<!--.*?-->|^>>>.*?(?:\n\n|\Z)|^ {4}.*?$"
    text = re.sub(code, "\n", text, flags=re.S | re.M)
    text = re.sub(r"`[^`]*`|https?://\S+", "X", re.sub(r"\]\([^)]*\)", "]", text))
    text = re.sub(r"\b(e\.g|i\.e|et al|vs|cf|No|Fig)\.", r"\1", text)
    for paragraph in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) ", "\n" + text):
        lines = paragraph.splitlines()
        prose = " ".join(line for line in lines if not re.match(r"\s*([|#]|!\[|---)", line))
        yield from re.split(r"(?<=[.!?:])\s+", " ".join(prose.split()))


def check_text(text, kind):
    """Yield departures in a page, docstring or message."""
    for sentence in sentences(text):
        for match in re.finditer(rf"\b(?:{BANNED})\b", sentence, re.I):
            yield f"banned word: {match.group()} ({sentence[:60]})"
        if len(sentence.split()) > MAX_WORDS[kind]:
            yield f"long sentence: {sentence[:80]}"


def syntax_nodes(tree):
    """Return the nodes of a syntax tree without contexts, faster than `ast.walk`."""
    nodes = [tree]
    for node in nodes:
        for value in vars(node).values():
            if isinstance(value, list):
                nodes += [item for item in value if isinstance(item, ast.AST)]
            elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
                nodes.append(value)
    return nodes


def strings(nodes):
    """Yield docstrings and messages of at least four words, with their kind and line."""
    docstrings = {node.value for node in nodes if isinstance(node, ast.Expr)}
    parts = {part for node in nodes if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in nodes:
        if isinstance(node, ast.JoinedStr):
            text = "".join(p.value if isinstance(p, ast.Constant) else "X" for p in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in parts:
            text = node.value
        else:
            continue
        if node in docstrings:
            yield "docstring", node.lineno, cleandoc(text)
        elif len(text.split()) >= 4 and not re.search(r"[{}<>;]|\bSELECT\b", text):
            yield "message", node.lineno, text


def bound_name(node):
    """Return the name that a function, class, parameter or assignment binds; "" if none."""
    kind = type(node)
    if kind is ast.Name:
        return node.id if isinstance(node.ctx, ast.Store) else ""
    if kind is ast.arg:
        return node.arg
    return node.name if kind in (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef) else ""


def name_departures(source):
    """Yield lines and departures of the names of a module of `bench` or `reports`."""
    for node in syntax_nodes(ast.parse(source)):
        name = bound_name(node)
        words = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
        for word in (word.lower().removesuffix("s") for word in words):
            for private, instead in PRIVATE_WORDS.items():
                if word == private.removesuffix("s"):
                    yield node.lineno, f"private word: {name}; instead: {instead}"
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("trackmark"):
            for imported in node.names:
                if imported.asname:
                    yield node.lineno, f"renamed import: {imported.name} as {imported.asname}"


def check_code(source, test=False):
    """Yield lines and departures of a Python file."""
    nodes = syntax_nodes(ast.parse(source))
    for kind, line, text in strings(nodes):
        if kind == "docstring" and re.match(rf"(?:{OPENINGS})\b(?! place\b| situ\b)", text):
            yield line, f"docstring opening: {text.partition(chr(10))[0]}"
        if not test:
            yield from ((line, problem) for problem in check_text(text.split("\n---")[0], kind))
    for node in nodes:
        name = bound_name(node)
        if name and re.fullmatch(WEAK_NAMES, name.lstrip("_")):
            yield node.lineno, f"weak name: {name}"
        if name.startswith("test_") and len(name) > 60:
            yield node.lineno, f"long test name: {name}"


def test_prose_of_code_and_pages_follows_the_rules():
    departures = []
    for file in CODE:
        name = str(file.relative_to(ROOT))
        problems = check_code(file.read_text("utf-8"), name.startswith("tests/"))
        departures += [(name, line, problem) for line, problem in problems]
    for file in PAGES:
        problems = check_text(file.read_text("utf-8"), "page")
        departures += [(str(file.relative_to(ROOT)), 1, problem) for problem in problems]
    rest = [f"{name}:{line}: {text}" for name, line, text in departures]
    assert not rest, "\n".join(rest)


def test_names_have_one_word_per_concept():
    departures = [
        f"{file.relative_to(ROOT)}:{line}: {problem}"
        for folder in ("bench", "reports")
        for file in sorted((ROOT / folder).rglob("*.py"))
        for line, problem in name_departures(file.read_text("utf-8"))
    ]
    assert not departures, "\n".join(departures)


def test_name_rules_find_private_words_and_renamed_imports():
    source = "from trackmark.bench import store as other\nfrom math import inf as infinite\n"
    source += "class _PatienceOfRuns:\n    def knobs(self, why, reason):\n        pass\n"
    problems = [(line, text.partition(";")[0]) for line, text in name_departures(source)]
    assert sorted(problems) == [
        (1, "renamed import: store as other"),
        (3, "private word: _PatienceOfRuns"),
        (4, "private word: knobs"),
        (4, "private word: why"),
    ]


def test_prose_rules_find_each_kind_of_departure():
    source = f'def test_{"x" * 60}(known):\n    """What is seen."""\n    raise E("a word was told")'
    problems = [problem.partition(":")[0] for _, problem in check_code(source)]
    assert problems == ["docstring opening", "banned word", "long test name", "weak name"]
    assert next(check_text("A word " * 16, "page")).startswith("long sentence")
    assert not [*check_text("Run `told` and [a page](anew.md).\n\n```\nbeside\n```\n", "page")]
