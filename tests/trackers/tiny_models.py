"""Untrained ONNX networks of a few layers for OpenCV's trackers, written byte by byte.

Their score is high in bright regions, so trackers follow a bright target. An ONNX message is a
sequence of fields: number and kind, then a varint, or a length and as many bytes.
"""

import struct
from collections.abc import Iterable
from pathlib import Path


def write_models(folder: Path) -> dict[str, dict[str, str]]:
    """Write all models into a folder, and return the parameters of each tracker."""
    return {
        tracker: {parameter: _written(folder / f"{parameter}.onnx", content)}
        | {name: _written(folder / f"{name}.onnx", other) for name, other in rest}
        for tracker, ((parameter, content), *rest) in (
            (name, list(files.items())) for name, files in MODELS.items()
        )
    }


def _written(file: Path, content: bytes) -> str:
    file.write_bytes(content)
    return str(file)


def _varint(number: int) -> bytes:
    digits = b""
    while number > 127:
        digits += bytes([number & 127 | 128])
        number >>= 7
    return digits + bytes([number])


def _field(number: int, value: int | bytes | str) -> bytes:
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    content = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _node(kind: str, inputs: Iterable[str], output: str, **integers: list[int]) -> bytes:
    attributes = [
        _field(1, name)
        + b"".join(_field(8, value) for value in values)
        + _field(20, 7)  # of the kind "integers"
        for name, values in integers.items()
    ]
    return b"".join(
        [
            *(_field(1, name) for name in inputs),
            _field(2, output),
            _field(3, output),
            _field(4, kind),
            *(_field(5, attribute) for attribute in attributes),
        ]
    )


def _weights(name: str, shape: Iterable[int], values: Iterable[float]) -> bytes:
    numbers = list(values)
    raw = struct.pack(f"<{len(numbers)}f", *numbers)
    dimensions = b"".join(_field(1, side) for side in shape)
    return dimensions + _field(2, 1) + _field(8, name) + _field(9, raw)


def _image(name: str, channels: int, side: int | None) -> bytes:
    """Return an input or output of shape (1, channels, side, side); None: any side."""
    sides = [_field(2, "side") if side is None else _field(1, side)] * 2
    shape = [_field(1, 1), _field(1, channels), *sides]
    kind = _field(1, 1) + _field(2, b"".join(_field(1, dimension) for dimension in shape))
    return _field(1, name) + _field(2, _field(1, kind))


def _model(nodes, weights, inputs, outputs) -> bytes:
    graph = [
        *(_field(1, node) for node in nodes),
        _field(2, "tiny"),
        *(_field(5, tensor) for tensor in weights),
        *(_field(11, image) for image in inputs),
        *(_field(12, image) for image in outputs),
    ]
    return _field(1, 7) + _field(7, b"".join(graph)) + _field(8, _field(1, "") + _field(2, 13))


def _head(output: str, rows: Iterable[Iterable[float]], bias: Iterable[float], source: str):
    """Return node and weights of a 1 x 1 convolution of three channels."""
    rows, bias = list(rows), list(bias)
    names = [f"{output}_weights", f"{output}_bias"]
    node = _node("Conv", [source, *names], output, kernel_shape=[1, 1])
    flat = [value for row in rows for value in row]
    return node, [
        _weights(names[0], (len(rows), 3, 1, 1), flat),
        _weights(names[1], (len(rows),), bias),
    ]


def _means(source: str, output: str, pads: list[int]) -> bytes:
    """Return a layer of means over 16 x 16 pixels."""
    window = [16, 16]
    return _node("AveragePool", [source], output, kernel_shape=window, strides=window, pads=pads)


def _vit() -> bytes:
    nothing = _weights("nothing", (1, 3, 1, 1), (0.0, 0.0, 0.0))
    # Only blue: OpenCV 5.0 passes green and red on with inverted sign.
    score, score_weights = _head("scored", [(20.0, 0.0, 0.0)], [1.0], "seen")
    size, size_weights = _head("output2", [(0.0,) * 3] * 2, [0.21, 0.31], "seen")
    offset, offset_weights = _head("output3", [(0.0,) * 3] * 2, [0.5, 0.5], "seen")
    nodes = [
        _means("search", "means", [0] * 4),
        _node("GlobalAveragePool", ["template"], "kept"),
        _node("Mul", ["kept", "nothing"], "kept_nothing"),
        _node("Add", ["means", "kept_nothing"], "seen"),
        score,
        _node("Sigmoid", ["scored"], "output1"),
        size,
        offset,
    ]
    weights = [nothing, *score_weights, *size_weights, *offset_weights]
    inputs = [_image("template", 3, 128), _image("search", 3, 256)]
    outputs = [_image("output1", 1, 16), _image("output2", 2, 16), _image("output3", 2, 16)]
    return _model(nodes, weights, inputs, outputs)


def _nano_backbone() -> bytes:
    nodes = [_means("input", "output", [0, 0, 1, 1])]
    return _model(nodes, [], [_image("input", 3, None)], [_image("output", 3, None)])


def _nano_neckhead() -> bytes:
    nothing = _weights("nothing", (1, 3, 1, 1), (0.0, 0.0, 0.0))
    rows = [(0.0,) * 3, (0.1, 0.0, 0.0)]  # RGB
    score, score_weights = _head("output1", rows, [0.0, -10.0], "seen")
    size, size_weights = _head("output2", [(0.0,) * 3] * 4, [25.0, 35.0, 25.0, 35.0], "seen")
    nodes = [
        _node("GlobalAveragePool", ["input1"], "kept"),
        _node("Mul", ["kept", "nothing"], "kept_nothing"),
        _node("Add", ["input2", "kept_nothing"], "seen"),
        score,
        size,
    ]
    weights = [nothing, *score_weights, *size_weights]
    inputs = [_image("input1", 3, 8), _image("input2", 3, 16)]
    return _model(nodes, weights, inputs, [_image("output1", 2, 16), _image("output2", 4, 16)])


MODELS = {
    "opencv-nano": {"backbone": _nano_backbone(), "neckhead": _nano_neckhead()},
    "opencv-vit": {"net": _vit()},
}
"""Contents of model files, by tracker and parameter."""
