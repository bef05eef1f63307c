"""A suite: names of sequences, their knobs, and the modules that make scenes of these."""

import hashlib
import importlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from trackmark.datasets.interface import Sequence, Summary
from trackmark.datasets.metadata import SequenceMetadata, sequence_metadata
from trackmark.datasets.source_digest import tree_digest
from trackmark.datasets.synthetic.knobs import Knobs
from trackmark.datasets.versioning import find_version

if TYPE_CHECKING:
    from trackmark.datasets.synthetic.scene import Scene, Truth

FOLDER = Path(__file__).parent


class SceneModule(Protocol):
    """What a module offers that makes scenes."""

    __file__: str

    def scene(self, knobs: Any, *which: Any) -> "Scene":
        """Renderer and truth; nothing is painted yet. `which` is the entry's."""
        ...


@dataclass(frozen=True)
class Entry:
    """A sequence of a suite."""

    name: str  # full name, `suite/sequence`
    knobs: type[Knobs]  # what can be set of it
    # dotted name of the `SceneModule`. It brings Numba, so it is loaded only where a sequence is
    # opened
    module: str
    length: int  # frames, with all knobs at their defaults
    size: tuple[int, int]  # width and height of the images [pixels], likewise
    which: tuple[Any, ...] = ()  # what tells the sequence from others of the same module

    def opened(self, options: Mapping[str, str]) -> tuple[Knobs, SceneModule]:
        """Checked knobs, and the module.

        Raises `SequenceError` for an unknown knob or a value out of its bounds.
        """
        knobs = self.knobs.checked(self.name, options)
        return knobs, cast(SceneModule, importlib.import_module(self.module))


class Suite:
    """Sequences that are rendered.

    `folder`: Of the suite; its `golden.json` holds the seals (see `datasets.versioning`).
    `entries`: The sequences.
    """

    def __init__(self, folder: Path, entries: Iterable[Entry]) -> None:
        self.entries = {entry.name: entry for entry in entries}
        self.golden = folder / "golden.json"
        # A command opens a sequence to plan, to examine and to draw it; solids take a second each.
        self._truth = lru_cache(maxsize=1024)(self._true)

    def names(self) -> list[str]:
        """Names of the sequences, without options."""
        return list(self.entries)

    def options(self, name: str) -> list[dict[str, Any]]:
        """What can be set of a sequence: `name`, `default` and `meaning` of every knob."""
        return self.entries[name].knobs.described()

    def summary(self, name: str) -> Summary:
        """Length and size of images of one of `names()` as it is by default."""
        return Summary(self.entries[name].length, self.entries[name].size)

    def describe(self, name: str) -> SequenceMetadata:
        """What a description tells of one of `names()`: as sealed, while its source is."""
        entry, seal = self.entries[name], find_version(name, self.golden)
        if seal is None or seal.tree != self.tree(name) or name not in seal.known:
            return sequence_metadata(self.load(name, {}), entry.size)
        knobs = entry.knobs.checked(name, {})
        return SequenceMetadata(
            name=knobs.canonical_name(name),
            length=entry.length,
            size=entry.size,
            truth_source=name,
            images_beyond_truth=0,
            fingerprint=self._fingerprint(entry, knobs),
            **seal.known[name],
        )

    def identity(self, name: str, options: Mapping[str, str]) -> tuple[str, str]:
        """Name and fingerprint of the sequence that `load` gives; errors are as of it."""
        entry = self.entries[name]
        knobs = entry.knobs.checked(name, options)
        return knobs.canonical_name(name), self._fingerprint(entry, knobs)

    def load(self, name: str, options: Mapping[str, str]) -> Sequence:
        """Sequence of one of `names()` with some knobs set; renders nothing.

        Raises `SequenceError` for an unknown knob or a value out of its bounds.
        """
        entry = self.entries[name]
        knobs, module = entry.opened(options)
        scene, truth = module.scene(knobs, *entry.which), self._truth(name, knobs)
        return Sequence(
            knobs.canonical_name(name),
            scene,
            truth.boxes,
            fingerprint=lambda: self._fingerprint(entry, knobs),
            regions=truth.regions,
            visibility=truth.visibility,
            attributes=truth.attributes,
            fps=scene.fps,
            masks=scene.mask,
            image_size=scene.size,
        )

    def _true(self, name: str, knobs: Knobs) -> "Truth":
        entry = self.entries[name]
        module = cast(SceneModule, importlib.import_module(entry.module))
        return module.scene(knobs, *entry.which).truth()

    def tree(self, name: str) -> str:
        """Digest of the syntax trees that make a sequence's scenes: of modules in this folder.

        Nothing elsewhere makes a pixel or a truth value.
        """
        return _scene_tree(self.entries[name].module)

    def _fingerprint(self, entry: Entry, knobs: Knobs) -> str:
        tree = self.tree(entry.name)
        seal = find_version(entry.name, self.golden)
        version = [tree] if seal is None else seal.identity(tree)
        identity = [entry.name, _identity(knobs), *version]
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:16]


@cache
def _scene_tree(module: str) -> str:
    """Return the digest of a scene module, once per process: it is read for every stored run."""
    file = FOLDER.parents[2].joinpath(*module.split("."))
    return tree_digest(file.with_suffix(".py"), FOLDER)


def _identity(knobs: Knobs) -> dict[str, Any]:
    """All that is set, by name, but for knobs that are marked `later` and at their default.

    They were added after results had been stored, and give by default what there was before.
    """
    later = {
        name: field.default
        for name, field in type(knobs).model_fields.items()
        if isinstance(field.json_schema_extra, dict) and field.json_schema_extra.get("later")
    }
    values = knobs.model_dump()
    return {name: value for name, value in values.items() if later.get(name, ...) != value}


@cache
def suites() -> list[Suite]:
    """List the suites: folders here whose package has a `SUITE`."""
    folders = sorted(file.parent.name for file in FOLDER.glob("*/__init__.py"))
    packages = [importlib.import_module(f"trackmark.datasets.synthetic.{name}") for name in folders]
    return [package.SUITE for package in packages if hasattr(package, "SUITE")]
