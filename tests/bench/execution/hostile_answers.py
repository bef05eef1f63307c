"""Trackers that raise exceptions or return malformed estimates in frame 3.

A row has the statement of frame 3 and a pattern of the failure. An empty pattern means that the run
finishes.
"""

from tests.bench.execution.hostile import HEAD

BOX = "the box"
# Estimates with these boxes.
BOXES = [
    ("None", BOX),
    ("self.box[None]", BOX),
    ("np.array(list('1234'))", BOX),
    ("np.array([10**400] * 4)", BOX),
    ("np.array([Unfloatable()] * 4)", BOX),
    ("np.array([nan, 0, 5, 5])", "finite"),
    ("np.array([0, 0, 5.0, 0])", "positive"),
    ("np.array([1, 1, 1 << 63, 5], np.uint64)", ""),
    ("np.ma.masked_array(self.box, [True] * 4)", "masked values"),
]
# Estimates with a valid box.
OTHERS = [
    ("confidence=1.5", "confidence"),
    ("confidence=10**400", "the confidence is 1000.*Expected: a number in"),
    ("confidence='0.5'", "the confidence is '0.5'"),
    ("visible=np.ones(2)", r"visible is an array of shape \(2,\)"),
    ("visible='no'", "visible is 'no'"),
    ("details=None", ""),
    ("details={'a': None}", ""),
    ("details={'a': 'b'}", r"details\['a'\] is 'b'\. Expected: a number by its name"),
    ("details={'a': Unfloatable()}", r"details\['a'\] is .*Unfloatable"),
    ("details={5: 1.0}", "detail"),
    ("mask=image", "mask"),
    ("mask=np.ones((2, 2), bool)", "mask"),
    ("revised=5", "AttributeError"),
    ("revised={-1: self.box}", "revised"),
    ("revised={1: self.box * nan}", "finite"),
]
# Statements in frame 3.
ACTS = [
    ("return 5", "returned 5"),
    ("yield Estimate(self.box)", "generator"),
    ("return Unspeakable()", "returned an object of type Unspeakable"),
    ("raise RuntimeError('no wish to go on')", "RuntimeError: no wish to go on"),
    ("raise Unspeakable", "Unspeakable"),
    ("raise RuntimeError('x' * 5_000_000)", "RuntimeError: xxx"),
    ("raise RuntimeError('a\\nb\\r\\x1b[2Jc')", "RuntimeError: a"),
    ("raise BaseException('base')", "BaseException: base"),
    ("raise SystemExit(Unspeakable())", "SystemExit"),
    ("return self.strike(image)", "RecursionError"),
    ("image[:] = 0", "read-only"),
    ("cv2.rectangle(image, (0, 0), (9, 9), 0, -1)", "cv2|error"),
    ("type(self).__name__ = 'Innocent'", ""),
    ("return Estimate(self.box, arrays=5)", ""),
]

KINDS = """
from math import nan

import cv2


class Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError("this has no text")

    __repr__ = __str__


class Unfloatable:
    def __float__(self):
        raise RuntimeError("this is no number")

"""

ROWS = {
    f"Says{number}": row
    for number, row in enumerate(
        [
            *((f"return Estimate({box})", words) for box, words in BOXES),
            *((f"return Estimate(self.box.copy(), {values})", words) for values, words in OTHERS),
            *ACTS,
        ]
    )
}
"""Statement and pattern by the name of the tracker."""


def source():
    """Return the Python source of all trackers."""
    text = f'"""{__doc__}"""\n{HEAD}{KINDS}'
    for name, (act, _) in ROWS.items():
        text += f"\n\nclass {name}(Hostile):\n    def strike(self, image):\n        {act}\n"
    return text
