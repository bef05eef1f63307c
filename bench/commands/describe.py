"""Describe a tracker, a sequence, a folder of some, a metrics preset, an attribute, a protocol."""

import ast
import json
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any

import click

from trackmark.bench.commands._options import json_option, patience, progress_bar, truth_option
from trackmark.reports.printable import wrapped


@click.command("describe")
@click.argument("name")
@truth_option
@click.option(
    "--attributes",
    "measure",
    is_flag=True,
    help="Of a sequence: also what is measured in its frames, which are opened for it once.",
)
@json_option
def command(name: str, truth: Path | None, measure: bool, as_json: bool) -> None:
    """Describe NAME: a tracker, sequence (built-in or a path), preset, attribute or protocol.

    Of a folder of sequences, or a pattern, it says which they are. A preset is one of metrics, an
    attribute one that is measured of sequences (`trackmark list`).
    """
    from trackmark import trackers
    from trackmark.bench import metrics, protocols
    from trackmark.trackers.base.catalogue import in_file

    if not name.strip():
        raise click.UsageError("NAME is empty: give what is to be described (`trackmark list`).")
    bare = name.partition(":")[0]
    if in_file(name) or bare in trackers.names():
        from trackmark.bench.experiments.tracker_files import described
        from trackmark.bench.experiments.tracker_spec import split_text

        plain, options = split_text(name)
        try:
            about = described(plain)
            about["name"] = options.get("as", about["name"])
            lines = _tracker_lines(about)
        except trackers.TrackerError as error:
            about = _unusable(plain, error)
            lines = [about["name"], "", about["summary"], "", about["unusable"]]
    elif metrics.knows(name) and truth is None:
        about = _metrics(name)
        lines = _metrics_lines(about)
        if name in protocols.names():  # two things have this name
            about["protocol_of_this_name"] = protocols.definition(name)
            lines += ["", *_protocol_lines(about["protocol_of_this_name"])]
    elif bare in protocols.names() and truth is None:
        about = protocols.definition(name)
        lines = _protocol_lines(about)
    elif truth is None and name.isidentifier() and (about := _attribute(name)):
        lines = [f"{key:11} {value}" for key, value in about.items() if value]
    elif truth is None and (about := _several(name)):
        lines = [f"{key:12} {value}" for key, value in about.items() if key != "of them"]
        lines += [f"  {text}" for text in about["of them"]]
    else:
        about = _sequence(name, truth)
        said = {key: value for key, value in about.items() if value and key != "knobs"}
        said |= {"fps": f"{about['fps']:.5g}"} if about["fps"] else {}
        lines = [f"{key:12} {value}" for key, value in said.items()]
        lines += _setting_lines("knobs", about["knobs"])
        if measure:
            about["measured"] = _measured(name, truth)
            lines += _measured_lines(about["measured"])
    click.echo(json.dumps(about, indent=1, default=str) if as_json else wrapped("\n".join(lines)))


def _tracker_lines(about: dict[str, Any]) -> list[str]:
    lines = [about["name"], "", about["summary"], ""]
    if about["paper"]:
        lines.append(f"paper       {about['paper']}")
    lines.append(f"randomness  {about['randomness']}")
    lines.append("presets")
    for preset, values in about["presets"].items():
        changed = ", ".join(f"{key}={value}" for key, value in values.items())
        alone = " (what the name alone means)" if preset == about["default_preset"] else ""
        lines.append(f"  {preset:14} {changed or 'the defaults'}{alone}")
    return lines + _setting_lines("parameters", about["parameters"])


def _unusable(name: str, error: Exception) -> dict[str, Any]:
    """What a tracker of the package is whose library is not installed, read from its file.

    Raises `error` for a tracker of any other kind.
    """
    from trackmark import trackers

    file = Path(trackers.__file__).parent / f"{name.replace('-', '_')}.py"
    if not file.is_file():
        raise error
    classes = [node for node in ast.parse(file.read_bytes()).body if isinstance(node, ast.ClassDef)]
    summary = ast.get_docstring(classes[-1]) or ""
    return {"name": name, "summary": summary, "unusable": f"{error} Then it tells its parameters."}


def _metrics(name: str) -> dict[str, Any]:
    from trackmark.bench import metrics

    preset = metrics.preset(name)
    summary, _, definition = metrics.definition(name).partition("\n\n")
    return {
        "name": metrics.canonical(name),
        "summary": summary,
        "definition": definition,
        "also": list(preset.also),
        "agrees": preset.agrees,
        "protocol": preset.protocol,
        "columns": {key: asdict(column) for key, column in preset.columns.items()},
        "curves": {key: asdict(axes) for key, axes in preset.curves.items()},
    }


def _metrics_lines(about: dict[str, Any]) -> list[str]:
    lines = [about["name"], "", about["summary"], "", about["definition"], ""]
    lines.append(f"agrees with  {about['agrees'] or 'nobody'}")
    lines.append(f"judges       runs by the protocol {about['protocol']!r}")
    lines += [f"also called  {', '.join(about['also'])}"] if about["also"] else []
    lines += [f"curves       {', '.join(about['curves'])}"] if about["curves"] else []
    lines.append("scores, and what a perfect tracker gets")
    width = max(map(len, about["columns"]))
    for key, column in about["columns"].items():
        perfect = "" if column["perfect"] is None else f"{column['perfect']:.3g}"
        lines.append(f"  {key:{width}}  {perfect:5}  {column['meaning']}")
    return lines


def _attribute(name: str) -> dict[str, Any]:
    """What is told of an attribute; nothing for another name."""
    from trackmark.datasets import attributes

    if name not in attributes.names():
        return {}
    one = attributes.of_name(name)
    return {
        "name": one.name,
        "unit": one.unit,
        "range": f"{one.least:g} to {one.most:g}",
        "sequence": f"{one.over} of its frames",
        "definition": one.definition.replace("\n", f"\n{'':12}").replace(f"\n{'':12}\n", "\n\n"),
    }


def _measured(name: str, truth: Path | None) -> dict[str, Any]:
    """Attributes of a sequence: a value of the whole, and those of its frames."""
    from trackmark import datasets
    from trackmark.datasets import attributes

    with progress_bar(None, "frame") as progress:
        series = attributes.measured(datasets.load(name, truth), progress)
    whole = attributes.overall(series)
    return {
        one.name: {
            "value": _or_none(whole[one.name]),
            "unit": one.unit,
            "over": one.over,
            "frames": [_or_none(value) for value in series[one.name].tolist()],
        }
        for one in map(attributes.of_name, attributes.names())
    }


def _measured_lines(measured: dict[str, Any]) -> list[str]:
    """A line an attribute; of which frames a value is where it is not their mean."""
    lines = ["measured (`trackmark describe NAME` defines each)"]
    for name, one in measured.items():
        value = "none" if one["value"] is None else f"{one['value']:.3g}"
        lines.append(f"  {name:18} {value:>8} {one['unit']:14} {one['over']} of frames")
    return lines


def _or_none(value: float) -> float | None:
    return value if isfinite(value) else None


def _protocol_lines(about: dict[str, Any]) -> list[str]:
    lines = [f"protocol {about['name']}", "", about["summary"], "", about["definition"], ""]
    lines.append(f"tables by    the metrics preset {about['preset']}, unless others are asked for")
    return lines + _setting_lines("knobs", about["knobs"])


def _setting_lines(heading: str, settings: list[dict[str, Any]]) -> list[str]:
    """Lines about what can be set: value by default, type and meaning."""
    if not settings:
        return []
    texts = [f"{setting['name']}={setting['default']}" for setting in settings]
    width = max(len(text) for text in texts)
    return [heading] + [
        f"  {text:{width}}  {setting['meaning']}"
        + (f" ({setting['type']})" if "|" in setting.get("type", "") else "")
        for text, setting in zip(texts, settings, strict=True)
    ]


def _several(name: str) -> dict[str, Any]:
    """What is told of a folder of sequences or a pattern; nothing where a name is neither."""
    from trackmark import datasets
    from trackmark.datasets.catalogue import is_built_in

    if is_built_in(name) or datasets.taken_for(name):
        return {}
    with patience("Looking for sequences"):
        found = datasets.matching(name)
    if found == [name]:
        return {}
    kinds = dict.fromkeys(filter(None, map(datasets.taken_for, found)))
    return {
        "name": name,
        "sequences": len(found),
        "taken for": "; ".join(kinds) or "built-in sequences",
        "of them": found,
    }


def _sequence(name: str, truth: Path | None) -> dict[str, Any]:
    from trackmark import datasets, trackers
    from trackmark.trackers.base.parameters import closest

    try:
        with patience(f"Opening {name}"):
            found = datasets.outline(name, truth)
    except datasets.SequenceError as error:
        close = closest(name.partition(":")[0], trackers.names())
        if not close or Path(name).expanduser().exists():
            raise
        raise datasets.SequenceError(f"{error} Did you mean the tracker {close!r}?") from None
    width, height = found.size
    none = f"none {found.truth_missing}".strip()
    beyond = f"{found.images_beyond_truth} images beyond the last truth row"
    origin = found.origin
    licence = origin.licence or "not stated with the data" if origin.format else origin.licence
    return {
        "name": found.name,
        "frames": found.length,
        "size": f"{width}x{height} pixels",
        "fps": found.fps,
        "truth": f"{found.present} of {found.length} frames" if found.present else none,
        "truth from": found.truth_source if found.present else "",
        "not read": beyond if found.images_beyond_truth else "",
        "regions": ", ".join(found.regions),
        "attributes": ", ".join(f"{key} ({n} frames)" for key, n in found.attributes.items()),
        "taken for": origin.format,
        "says": origin.description,
        "licence": licence,
        "cite": origin.citation,
        "fingerprint": found.fingerprint,
        "knobs": datasets.options(name),
    }
