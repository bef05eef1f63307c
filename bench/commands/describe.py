"""Describe a tracker, sequence, metrics, attribute or protocol."""

import json
import re
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from trackmark.bench.commands._options import (
    SPECIFICATION,
    Command,
    input_option,
    json_option,
    layout_option,
    truth_option,
)
from trackmark.bench.commands._progress import progress_bar, report_slow_work
from trackmark.reports.printable import wrap

if TYPE_CHECKING:
    from trackmark.datasets.interface import SequenceMetadata
    from trackmark.datasets.official_sets import Coverage


@click.command("describe", cls=Command)
@click.argument("name", type=SPECIFICATION)
@truth_option
@layout_option
@input_option(
    "--attributes",
    "with_attributes",
    is_flag=True,
    help="Also measure the attributes of a sequence; this reads all of its frames.",
)
@json_option
def command(name: str, truth: Path | None, with_attributes: bool, as_json: bool) -> None:
    """Describe a tracker, sequence, metrics, attribute or protocol.

    NAME is a name of `trackmark list`, the path of a sequence or tracker file, or a folder or
    pattern, whose sequences are listed.

    For example:
      trackmark describe camshift
      trackmark describe samples/face --attributes

    Exit codes: 0 success; 2 unknown name or invalid input.
    """
    if not name.strip():
        raise click.UsageError("NAME is empty. Give a name of `trackmark list` or a path.")
    description = _tracker(name) or (_named(name) if truth is None else None)
    json_object, lines = description or _sequence(name, truth, with_attributes=with_attributes)
    if as_json:
        click.echo(json.dumps(json_object, indent=1, default=str))
    else:
        click.echo(wrap("\n".join(map(_join_lines, lines))))


def _join_lines(prose: str) -> str:
    """Return the text with one line per paragraph; lists and indented lines are kept."""
    return re.sub(r"(?<=\S)\n(?![\s*|-])", " ", prose)


Description = tuple[dict[str, Any], list[str]]
"""Data for --json, and lines of text for the terminal."""


def _tracker(name: str) -> Description | None:
    from trackmark import trackers
    from trackmark.bench.experiments.tracker_spec import describe_tracker, split_text
    from trackmark.bench.external import is_external, split_table
    from trackmark.trackers.base.catalogue import in_file, is_outside, summary

    outside = split_table(name) or in_file(name) or name.startswith("trax:")
    if not (outside or name.partition(":")[0] in trackers.names()):
        return None
    plain, options = split_text(name)
    try:
        json_object = describe_tracker(name if is_external(plain, options) else plain)
    except trackers.TrackerError as error:
        if outside or is_outside(plain):
            raise
        # A library of the tracker is not installed.
        unusable = f"{error} `describe` then shows its parameters, too."
        json_object = {"name": plain, "summary": summary(plain), "unusable": unusable}
        return json_object, [plain, "", json_object["summary"], "", unusable]
    json_object["name"] = options.get("as", json_object["name"])
    lines = [json_object["name"], "", json_object["summary"], ""]
    if json_object["paper"]:
        lines.append(f"paper       {json_object['paper']}")
    lines += [f"randomness  {json_object['randomness']}", "presets"]
    for preset, values in json_object["presets"].items():
        changed = ", ".join(f"{key}={value}" for key, value in values.items())
        default = " (the default)" if preset == json_object["default_preset"] else ""
        lines.append(f"  {preset:14} {changed or 'the defaults'}{default}")
    lines += _parameter_lines(json_object["parameters"])
    return json_object, lines + _origin_lines(json_object)


def _named(name: str) -> Description | None:
    """Describe metrics, a protocol, attribute or group of sequences; None for other names."""
    from trackmark.bench import metrics, protocols

    bare = name.partition(":")[0]
    if metrics.are_metrics(name):
        json_object, lines = _metrics(name)
        if name in protocols.names():  # metrics and a protocol have this name
            json_object["protocol"] = protocols.describe_protocol(name)
            lines += ["", *_protocol_lines(json_object["protocol"])]
        return json_object, lines
    if bare in protocols.names():
        json_object = protocols.describe_protocol(name)
        return json_object, _protocol_lines(json_object)
    if name.isidentifier() and (json_object := _attribute(name)):
        return json_object, [f"{key:11} {value}" for key, value in json_object.items() if value]
    return _several(name)


def _metrics(name: str) -> Description:
    from trackmark.bench import metrics

    definitions = metrics.find_metrics(name)
    summary, _, definition = metrics.describe(name).partition("\n\n")
    json_object = {
        "name": metrics.canonical_name(name),
        "summary": summary,
        "definition": definition,
        "aliases": list(definitions.aliases),
        "agrees_with": definitions.agrees_with,
        "run_kind": definitions.run_kind,
        "metrics": {key: asdict(metric) for key, metric in definitions.metrics.items()},
        "curves": {key: {"x": x, "y": y} for key, (x, y) in definitions.curves.items()},
    }
    lines = [metrics.canonical_name(name), "", summary, "", definition, ""]
    lines.append(f"agrees with  {definitions.agrees_with or 'no toolkit'}")
    lines.append(f"scores       runs of the kind {definitions.run_kind!r}")
    lines += [f"also called  {', '.join(definitions.aliases)}"] if definitions.aliases else []
    lines += [f"curves       {', '.join(definitions.curves)}"] if definitions.curves else []
    lines.append("metrics, with the score of a perfect tracker")
    width = max(map(len, definitions.metrics))
    for key, metric in definitions.metrics.items():
        perfect = "" if metric.best_value is None else f"{metric.best_value:.3g}"
        lines.append(f"  {key:{width}}  {perfect:5}  {metric.meaning}")
    return json_object, lines


def _protocol_lines(description: dict[str, Any]) -> list[str]:
    lines = [
        f"protocol {description['name']}",
        "",
        description["summary"],
        "",
        description["definition"],
        "",
    ]
    lines.append(f"metrics      {description['metrics']} (of its runs by default)")
    return lines + _parameter_lines(description["parameters"])


def _parameter_lines(parameters: list[dict[str, Any]]) -> list[str]:
    """Return a heading and one line per parameter with its default, meaning and type."""
    if not parameters:
        return []
    assignments = [f"{parameter['name']}={parameter['default']}" for parameter in parameters]
    width = max(len(assignment) for assignment in assignments)
    return ["parameters"] + [
        f"  {assignment:{width}}  {parameter['meaning']}"
        + (f" ({parameter['type']})" if "|" in parameter.get("type", "") else "")
        for assignment, parameter in zip(assignments, parameters, strict=True)
    ]


def _origin_lines(tracker: dict[str, Any]) -> list[str]:
    """Return the origins of a tracker's parameters, and its choices that are no parameters."""
    rows = [
        (f"{parameter['name']}={parameter['as_written']}", parameter["origin"])
        for parameter in tracker["parameters"]
        if parameter["origin"]
    ]
    width = max((len(assignment) for assignment, _ in rows), default=0)
    lines = ["origins of the values in as-written"] if rows else []
    lines += [f"  {assignment:{width}}  {origin}" for assignment, origin in rows]
    if tracker["choices"]:
        lines.append("choices that are no parameters")
    return lines + [
        f"  {choice['name']}: {choice['value']} ({choice['reason']})"
        for choice in tracker["choices"]
    ]


def _attribute(name: str) -> dict[str, Any]:
    """Return data on an attribute; an empty dictionary if there is no such attribute."""
    from trackmark.datasets import attributes

    if name not in attributes.ATTRIBUTES:
        return {}
    attribute = attributes.ATTRIBUTES[name]
    indent = f"\n{'':12}"
    return {
        "name": attribute.name,
        "unit": attribute.unit,
        "range": f"{attribute.minimum:g} to {attribute.maximum:g}",
        "sequence": f"{attribute.statistic} of its frames",
        "definition": attribute.definition.replace("\n", indent).replace(f"{indent}\n", "\n\n"),
    }


def _several(name: str) -> Description | None:
    """Describe a folder of sequences or a pattern; None for other names."""
    from trackmark import datasets
    from trackmark.datasets.catalogue import is_built_in

    if is_built_in(name) or datasets.path_format(name):
        return None
    with report_slow_work("Looking for sequences"):
        names = datasets.matching(name)
    if names == [name]:
        return None
    formats = dict.fromkeys(filter(None, map(datasets.path_format, names)))
    json_object: dict[str, Any] = {
        "name": name,
        "sequences": len(names),
        "format": "; ".join(formats) or "built-in sequences",
    }
    lines = [f"{key:12} {value}" for key, value in json_object.items()]
    coverages = [entry for text in formats for entry in _coverages(text, names)]
    lines += [f"{'official':12} {entry}" for entry in coverages]
    official = [
        {
            "name": entry.official.name,
            "sequences": entry.official.size,
            "missing": entry.missing,
            "unknown": entry.unknown,
        }
        for entry in coverages
    ]
    return {**json_object, "official": official, "sequence_names": names}, lines + [
        f"  {x}" for x in names
    ]


def _coverages(expected: str, paths: list[str]) -> "list[Coverage]":
    """Compare a folder's sequences with the official sets of their format."""
    from trackmark.datasets import official_sets, readers

    layout = next(name for name, text in readers.formats().items() if text == expected)
    # OTB calls the targets of a folder `Jogging.1` and `Jogging.2`.
    names = [Path(path).name.replace(":target=", ".") for path in paths]
    return official_sets.compare(layout, names)


def _sequence(name: str, truth: Path | None, *, with_attributes: bool) -> Description:
    from trackmark import datasets, trackers
    from trackmark.trackers.base.parameters import closest_match

    try:
        with report_slow_work(f"Opening {name}"):
            metadata = datasets.describe(name, truth)
    except datasets.SequenceError as error:
        close = closest_match(name.partition(":")[0], trackers.names())
        if not close or Path(name).expanduser().exists():
            raise
        raise datasets.SequenceError(f"{error} Did you mean the tracker {close!r}?") from None
    width, height = metadata.size
    none = f"none {metadata.truth_missing}".strip()
    origin = metadata.origin
    json_object: dict[str, Any] = {
        "name": metadata.name,
        "frames": metadata.length,
        "size": f"{width}x{height} pixels",
        "fps": metadata.fps,
        "truth": _truth(metadata) if metadata.present else none,
        "truth_source": metadata.truth_source if metadata.present else "",
        "remarks": " ".join(metadata.remarks),
        "regions": ", ".join(metadata.regions),
        "attributes": ", ".join(f"{key} ({n} frames)" for key, n in metadata.attributes.items()),
        "format": origin.format,
        "description": origin.description,
        "licence": origin.licence or "not stated with the data" * bool(origin.format),
        "citation": origin.citation,
        "fingerprint": metadata.fingerprint,
    }
    fields = json_object | ({"fps": f"{metadata.fps:.5g}"} if metadata.fps else {})
    lines = [f"{key.replace('_', ' '):12} {value}" for key, value in fields.items() if value]
    json_object["parameters"] = datasets.options(name)
    lines += _parameter_lines(json_object["parameters"])
    if with_attributes:
        json_object["measured_attributes"] = _measured(name, truth)
        lines.append("measured (`trackmark describe NAME` defines each)")
        for attribute, measured in json_object["measured_attributes"].items():
            value = "none" if measured["value"] is None else f"{measured['value']:.3g}"
            lines.append(
                f"  {attribute:18} {value:>8} {measured['unit']:14} "
                f"{measured['statistic']} of frames"
            )
    return json_object, lines


def _truth(metadata: "SequenceMetadata") -> str:
    """Return the numbers of frames in which the target is present, absent and not annotated."""
    n_absent = metadata.annotated - metadata.present
    n_unknown = metadata.length - metadata.annotated
    absent = f", absent in {n_absent}" if n_absent else ""
    unknown = f", not annotated in {n_unknown}" if n_unknown else ""
    return f"target present in {metadata.present} of {metadata.length} frames{absent}{unknown}"


def _measured(name: str, truth: Path | None) -> dict[str, Any]:
    """Return attributes of a sequence: one value for the sequence and one per frame."""
    from trackmark import datasets
    from trackmark.datasets import attributes

    def finite(value: float) -> float | None:
        return value if isfinite(value) else None

    with progress_bar("Measuring attributes", None, "frame") as progress:
        series = attributes.measure(datasets.load(name, truth), progress)
    overall = attributes.overall(series)
    return {
        attribute.name: {
            "value": finite(overall[attribute.name]),
            "unit": attribute.unit,
            "statistic": attribute.statistic,
            "frames": [finite(value) for value in series[attribute.name].tolist()],
        }
        for attribute in attributes.ATTRIBUTES.values()
    }
