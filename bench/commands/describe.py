"""Describe a tracker or a sequence: parameters, presets, paper; size, truth, attributes."""

import json
from pathlib import Path
from typing import Any

import click

from bench.commands._options import json_option, truth_option

__all__ = ["command"]


@click.command("describe")
@click.argument("name")
@truth_option
@json_option
def command(name: str, truth: Path | None, as_json: bool) -> None:
    """Describe the tracker or the sequence NAME (a built-in name or a path)."""
    import trackers

    bare = name.partition(":")[0]
    if bare in trackers.names() or ".py:" in name:
        about = trackers.describe(name if ".py:" in name else bare)
        lines = _tracker_lines(about)
    else:
        about = _sequence(name, truth)
        said = {key: value for key, value in about.items() if value and key != "knobs"}
        lines = [f"{key:12} {value}" for key, value in said.items()]
        lines += _setting_lines("knobs", about["knobs"])
    click.echo(json.dumps(about, indent=1, default=str) if as_json else "\n".join(lines))


def _tracker_lines(about: dict[str, Any]) -> list[str]:
    lines = [about["name"], "", about["summary"], ""]
    if about["paper"]:
        lines.append(f"paper       {about['paper']}")
    lines.append(f"randomness  {about['randomness']}")
    lines.append("presets")
    for preset, values in about["presets"].items():
        changed = ", ".join(f"{key}={value}" for key, value in values.items())
        lines.append(f"  {preset:14} {changed or 'the defaults'}")
    return lines + _setting_lines("parameters", about["parameters"])


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


def _sequence(name: str, truth: Path | None) -> dict[str, Any]:
    import datasets

    sequence = datasets.load(name, truth=truth)
    if name in datasets.names():  # then its size is known without an image
        width, height = datasets.summary(name).size
    else:
        height, width = sequence[0].shape[:2]
    present = sequence.present
    return {
        "name": sequence.name,
        "frames": len(sequence),
        "size": f"{width}x{height} pixels",
        "fps": sequence.fps,
        "truth": f"{int(present.sum())} of {len(sequence)} frames" if present.any() else "none",
        "truth from": sequence.truth_source if present.any() else "",
        "not read": f"{sequence.images_beyond_truth} images beyond the last truth row"
        if sequence.images_beyond_truth
        else "",
        "regions": ", ".join(sequence.regions),
        "attributes": ", ".join(
            f"{key} ({int(flags.sum())} frames)"
            for key, flags in sequence.attributes.items()
            if flags.any()
        ),
        "fingerprint": sequence.fingerprint,
        "knobs": datasets.options(name),
    }
