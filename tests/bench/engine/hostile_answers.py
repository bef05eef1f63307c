"""What hostile trackers raise and answer: harmless to the process, whoever runs beside them.

A row is what one does in frame 3, in the terms of `hostile.HEAD`, and words of the failure that
names it; without words it is not a failure.
"""

from tests.bench.engine.hostile import HEAD

BOX = "the box"
# Answers by the box alone.
BOXES = [
    ("None", BOX),
    ("5.0", BOX),
    ("'1234'", BOX),
    ("b'1234'", BOX),
    ("self.box.tolist()", BOX),
    ("tuple(self.box)", BOX),
    ("iter(self.box)", BOX),
    ("memoryview(self.box)", BOX),
    ("self.box.data.tobytes()", BOX),
    ("type", BOX),
    ("lambda: self.box", BOX),
    ("self", BOX),
    ("[self.box]", BOX),
    ("{0: 1.0, 1: 1.0, 2: 1.0, 3: 1.0}", BOX),
    ("np.zeros(0)", BOX),
    ("np.array(1.0)", BOX),
    ("self.box[:3]", BOX),
    ("np.append(self.box, 1.0)", BOX),
    ("self.box[None]", BOX),
    ("self.box[:, None]", BOX),
    ("self.box.reshape(2, 2)", BOX),
    ("np.broadcast_to(self.box, (1 << 40, 4))", BOX),
    ("np.matrix(self.box)", BOX),
    ("np.array(list('1234'))", BOX),
    ("np.array([b'1'] * 4)", BOX),
    ("np.array([None] * 4)", "TypeError"),
    ("np.array([Decimal('1e400')] * 4)", BOX),
    ("np.array([Fraction(1)] * 4)", ""),
    ("np.array([10**400] * 4)", "OverflowError"),
    ("np.array([Unfloatable()] * 4)", "no number"),
    ("self.box.astype(complex)", BOX),
    ("self.box.astype('M8[s]')", BOX),
    ("self.box.astype('m8[s]')", BOX),
    ("self.box.astype('V8')", BOX),
    ("np.array([(1, 2)] * 4, 'i4,i4')", BOX),
    ("np.array([nan, 0, 5, 5])", "finite"),
    ("np.array([0, nan, 5, 5])", "finite"),
    ("np.array([0, 0, nan, 5])", "finite"),
    ("np.array([0, 0, 5, nan])", "finite"),
    ("np.full(4, inf)", "finite"),
    ("np.array([-inf, 0, 5, 5])", "finite"),
    ("np.array([0, 0, inf, 5])", "finite"),
    ("np.array([0, 0, 0, 5.0])", "positive"),
    ("np.array([0, 0, 5.0, 0])", "positive"),
    ("np.array([0, 0, -0.0, 5])", "positive"),
    ("np.array([0, 0, -5, 5])", "positive"),
    ("np.array([5, 5, -5, -5], np.int8)", "positive"),
    ("np.full(4, np.longdouble('1e4000'))", "finite"),
    ("np.array([0, 0, np.longdouble('1e-4000'), 1])", "positive"),
    ("np.full(4, 1e5, np.float16)", "finite"),
    ("np.full(4, np.nan, np.float16)", "finite"),
    ("self.box.view(Liar)", ""),
    ("self.box.astype('>f4')", ""),
    ("np.array([1, 1, 1 << 63, 5], np.uint64)", ""),
    ("np.ma.masked_array(self.box, [True] * 4)", ""),
    ("np.lib.stride_tricks.as_strided(self.box, (4,), (0,))", ""),
]
# Answers by what else an estimate holds; all with the right box.
OTHERS = [
    ("confidence=1.5", "confidence"),
    ("confidence=-0.1", "confidence"),
    ("confidence=inf", "confidence"),
    ("confidence=None", "TypeError"),
    ("confidence='much'", "ValueError"),
    ("confidence=1j", "TypeError"),
    ("confidence=10**400", "OverflowError"),
    ("confidence=np.ones(2)", "TypeError"),
    ("confidence=Unfloatable()", "no number"),
    ("visible=np.ones(2)", "ValueError"),
    ("visible=Undecided()", "undecided"),
    ("details=None", "AttributeError"),
    ("details=5", "AttributeError"),
    ("details=[('a', 1.0)]", "AttributeError"),
    ("details={'a': None}", ""),
    ("details={'a': 'b'}", "ValueError"),
    ("details={'a': 1j}", "TypeError"),
    ("details={'a': [1.0, 2.0]}", "ValueError"),
    ("details={'a': np.zeros(7)}", "ValueError"),
    ("details={'a': Unfloatable()}", "no number"),
    ("details={'a': 10**400}", "OverflowError"),
    ("details={5: 1.0}", "detail"),
    ("details={None: 1.0}", "detail"),
    ("details={b'a': 1.0}", "detail"),
    ("details={('a',): 1.0}", "detail"),
    ("details={'x': 1.0}", "detail"),
    ("details={'frame': 1.0}", "detail"),
    ("details={'a\\nb': 1.0}", "detail"),
    ("details={'\\x1b[31m': 1.0}", "detail"),
    ("details={'\\ud800': 1.0}", "detail"),
    ("details=Unreadable()", "unreadable"),
    ("details=Forgetful(a=1.0)", "unpack"),
    ("mask=5", "mask"),
    ("mask=[[True]]", "mask"),
    ("mask='mask'", "mask"),
    ("mask=image", "mask"),
    ("mask=image[..., 0]", "mask"),
    ("mask=image[..., 0].astype(float)", "mask"),
    ("mask=image > 9", "mask"),
    ("mask=np.ones((2, 2), bool)", "mask"),
    ("mask=(image[..., 0] > 9).T", "mask"),
    ("mask=np.array(None)", "mask"),
    ("mask=np.ones(image.shape[:2], object)", "mask"),
    ("revised=5", "AttributeError"),
    ("revised=[self.box]", "AttributeError"),
    ("revised=Unreadable()", "unreadable"),
    ("revised={-1: self.box}", "revised"),
    ("revised={4: self.box}", "revised"),
    ("revised={10**30: self.box}", "revised"),
    ("revised={1.5: self.box}", "revised"),
    ("revised={True: self.box}", "revised"),
    ("revised={None: self.box}", "Error"),
    ("revised={'1': self.box}", "Error"),
    ("revised={nan: self.box}", "revised"),
    ("revised={1: None}", BOX),
    ("revised={1: self.box[:3]}", BOX),
    ("revised={1: self.box * nan}", "finite"),
    ("revised={1: -self.box}", "positive"),
    ("revised={1: np.full(4, np.longdouble('1e4000'))}", "finite"),
]
# Whole acts.
ACTS = [
    ("return 5", "returned 5"),
    ("return self.box", "returned array"),
    ("return (self.box, True)", "returned"),
    ("return Estimate", "returned <class"),
    ("return NotImplemented", "NotImplemented"),
    ("return Alike(self.box)", "Alike"),
    ("yield Estimate(self.box)", "generator"),
    ("return Unspeakable()", "no text"),
    ("return object.__new__(Estimate)", "AttributeError"),
    ("return Estimate()", "TypeError"),
    ("return Hasty(self.box)", "no setter"),
    ("raise RuntimeError('no wish to go on')", "RuntimeError: no wish to go on"),
    ("raise RuntimeError", "RuntimeError"),
    ("raise Exception(b'\\xff', None, ['x'])", "Exception"),
    ("raise 'text'", "TypeError: exceptions must derive"),
    ("raise UnicodeDecodeError", "TypeError"),
    ("raise Unspeakable", "Unspeakable"),
    ("raise Speechless", "Speechless"),
    ("raise type('E' * 10**6, (Exception,), {})", "EEE"),
    ("raise type('E', (Exception,), {'__module__': None})", "E"),
    ("raise RuntimeError('x' * 5_000_000)", "RuntimeError: xxx"),
    ("raise RuntimeError('a\\nb\\r\\x1b[2Jc')", "RuntimeError: a"),
    ("raise RuntimeError('\\0')", "RuntimeError"),
    ("raise RuntimeError('\\udcff')", "RuntimeError"),
    ("raise OSError(2, 'gone', 'no \\udcff.png')", "gone"),
    ("raise UnicodeDecodeError('utf-8', b'\\xff', 0, 1, 'of spite')", "of spite"),
    ("raise SyntaxError('bad', ('f.py', -5, 10**9, None))", "SyntaxError: bad"),
    ("exec('a b')", "SyntaxError"),
    ("exec('(' * 10**4)", "[(]{9}"),
    ("raise KeyError", "KeyError"),
    ("raise StopIteration('enough')", "StopIteration: enough"),
    ("raise asyncio.CancelledError", "CancelledError"),
    ("raise BaseException('base')", "BaseException: base"),
    ("raise BaseExceptionGroup('many', [SystemExit(0), KeyboardInterrupt()])", "many"),
    ("raise ExceptionGroup('many', [ValueError()] * 10**3)", "many"),
    ("raise nested(200)", "nested"),
    ("raise chained(10**3)", "chained"),
    ("raise circular()", "circular"),
    ("raise noted(5)", "noted"),
    ("raise noted(Unspeakable())", "noted"),
    ("sys.exit(0)", "SystemExit"),
    ("sys.exit('farewell')", "farewell"),
    ("exit()", "SystemExit"),
    ("raise SystemExit(Unspeakable())", "SystemExit"),
    ("return self.strike(image)", "RecursionError"),
    ("return self.nothing", "nothing"),
    ("return nothing", "NameError"),
    ("import nothing_of_that_name", "ModuleNotFoundError"),
    ("return 1 / 0", "ZeroDivisionError"),
    ("assert False", "AssertionError"),
    ("return cv2.resize(image, (0, 0))", "cv2"),
    ("return np.linalg.inv(np.zeros((2, 2)))", "LinAlgError"),
    ("return open('/nowhere/at/all')", "FileNotFoundError"),
    ("return int('9' * 5000)", "ValueError"),
    ("return [].pop()", "IndexError"),
    ("image[:] = 0", "read-only"),
    ("image += 1", "."),
    ("image.fill(0)", "read-only"),
    ("image.sort()", "read-only"),
    ("image.put(0, 0)", "read-only"),
    ("np.copyto(image, 0)", "read-only"),
    ("np.add(image, 1, out=image)", "read-only"),
    ("image.T[0] = 0", "read-only"),
    ("image.ravel().setflags(write=True)", "WRITEABLE"),
    ("image.flags.writeable = True", "WRITEABLE"),
    ("image.data[0, 0, 0] = 0", "read-only"),
    ("memoryview(image).cast('B')[0] = 0", "read-only"),
    ("cv2.rectangle(image, (0, 0), (9, 9), 0, -1)", "cv2|error"),
    ("image.byteswap(inplace=True)", "."),
    ("random.Random(0).shuffle(image)", "read-only"),
    ("np.random.default_rng(0).shuffle(image)", "read-only"),
    ("image.partition(0)", "read-only"),
    ("self.update = None", ""),
    ("del self.box", "box"),
    ("type(self).__name__ = 'Innocent'", ""),
    ("self.parameters.x = 1", "Error"),
    ("self.box = self.box.view(Liar)", ""),
    ("return Estimate(self.box, arrays=5)", ""),
]

KINDS = """
import asyncio
from decimal import Decimal
from fractions import Fraction
from math import inf, nan

import cv2


class Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError("this has no text")

    __repr__ = __str__


class Speechless(Exception):
    def __str__(self):
        return 5


class Unfloatable:
    def __float__(self):
        raise RuntimeError("this is no number")


class Undecided:
    def __bool__(self):
        raise RuntimeError("this is undecided")


class Unreadable(dict):
    def items(self):
        raise RuntimeError("this is unreadable")

    __bool__ = lambda self: True


class Forgetful(dict):
    def items(self):
        return [5]


class Liar(np.ndarray):
    def tolist(self):
        return [float("nan")] * 4


class Alike:
    visible, confidence, mask, details, arrays, revised = True, 1.0, None, {}, {}, None

    def __init__(self, box):
        self.box = box


class Hasty(Estimate):
    @property
    def confidence(self):
        raise RuntimeError("there is no hurry")


def nested(depth):
    error = RuntimeError("nested")
    for _ in range(depth):
        error = ExceptionGroup("nested", [error])
    return error


def chained(length):
    last = error = RuntimeError("chained")
    for _ in range(length):
        last.__cause__ = RuntimeError("link")
        last = last.__cause__
    return error


def circular():
    error = RuntimeError("circular")
    error.__cause__ = RuntimeError("other")
    error.__cause__.__cause__ = error
    return error


def noted(what):
    error = RuntimeError("noted")
    error.__notes__ = what
    return error
"""

ROWS = {
    f"Says{number}": row
    for number, row in enumerate(
        [
            *((f"return Estimate({box})", words) for box, words in BOXES),
            *((f"return Estimate(self.box.copy(), {said})", words) for said, words in OTHERS),
            *ACTS,
        ]
    )
}
"""What they do, and words of what is said of it, by the tracker's name."""


def source():
    """Python source of all of them."""
    text = f'"""{__doc__}"""\n{HEAD}{KINDS}'
    for name, (act, _) in ROWS.items():
        text += f"\n\nclass {name}(Hostile):\n    def strike(self, image):\n        {act}\n"
    return text
