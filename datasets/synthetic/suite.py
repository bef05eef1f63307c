"""Suite of synthetic sequences: names, parameters and rendering modules."""

import hashlib
import importlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from trackmark.datasets.interface import Sequence, SequenceMetadata, SequenceSize, sequence_metadata
from trackmark.datasets.source_digest import tree_digest
from trackmark.datasets.synthetic.parameters import SequenceParameters
from trackmark.datasets.versioning import find_version

if TYPE_CHECKING:
    from trackmark.datasets.synthetic.scene import SyntheticScene

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class SequenceEntry:
    """Sequence of a suite."""

    name: str  # full name, `suite/sequence`
    parameters: type[SequenceParameters]  # parameters of the sequence
    # `module:name` of the scene's class, or of a function that returns the scene. The module is
    # imported only to open a sequence, because it imports Numba.
    renderer: str
    length: int  # number of frames for default parameters
    size: tuple[int, int]  # width and height of the images for default parameters [pixels]
    # further arguments of `renderer` that select this sequence
    which: tuple[Any, ...] = ()

    @property
    def module(self) -> str:
        """Dotted name of the scene's module."""
        return self.renderer.partition(":")[0]

    def create(self, parameters: SequenceParameters) -> "SyntheticScene":
        """Return a new scene, which gives the ground truth and renders frames on request."""
        name = self.renderer.partition(":")[2]
        renderer = getattr(importlib.import_module(self.module), name)
        return cast("SyntheticScene", renderer(parameters, *self.which))


class SyntheticSuite:
    """Synthetic sequences of one folder.

    `folder` is the folder of the suite. Its `golden.json` contains the versions of the scenes; see
    `datasets.versioning`.
    """

    def __init__(self, folder: Path, entries: Iterable[SequenceEntry]) -> None:
        self.entries = {entry.name: entry for entry in entries}
        self.golden = folder / "golden.json"
        # A command loads a sequence several times; computing the ground truth can take a second.
        self._truth = lru_cache(maxsize=1024)(lambda *key: self._scene(*key).truth())
        self._scene = lru_cache(maxsize=4)(lambda name, values: self.entries[name].create(values))

    def names(self) -> list[str]:
        """Return the names of the sequences, without options."""
        return list(self.entries)

    def options(self, name: str) -> list[dict[str, Any]]:
        """Return `name`, `default` and `meaning` of every parameter of a sequence."""
        return self.entries[name].parameters.described()

    def sequence_size(self, name: str) -> SequenceSize:
        """Return length and image size of a sequence with default parameters."""
        return SequenceSize(self.entries[name].length, self.entries[name].size)

    def describe(self, name: str) -> SequenceMetadata:
        """Return the metadata of a sequence, from `golden.json` if its source is unchanged."""
        entry, version = self.entries[name], find_version(name, self.golden)
        if version is None or version.tree != self.tree(name) or name not in version.metadata:
            return sequence_metadata(self.load(name, {}), entry.size)
        parameters = entry.parameters.checked(name, {})
        return SequenceMetadata(
            name=parameters.canonical_name(name),
            length=entry.length,
            size=entry.size,
            annotated=entry.length,
            truth_source=name,
            n_unread_images=0,
            fingerprint=self._fingerprint(entry, parameters),
            **version.metadata[name],
        )

    def name_and_fingerprint(self, name: str, options: Mapping[str, str]) -> tuple[str, str]:
        """Return name and fingerprint of the sequence that `load` opens; exceptions are equal."""
        entry = self.entries[name]
        parameters = entry.parameters.checked(name, options)
        return parameters.canonical_name(name), self._fingerprint(entry, parameters)

    def load(self, name: str, options: Mapping[str, str]) -> Sequence:
        """Return a sequence of the suite; parameters that `options` omits have their defaults.

        Raises `SequenceError` for an unknown parameter or a value outside its bounds.
        """
        entry = self.entries[name]
        parameters = entry.parameters.checked(name, options)
        scene, truth = self._scene(name, parameters), self._truth(name, parameters)
        return Sequence(
            parameters.canonical_name(name),
            scene,
            truth.boxes,
            fingerprint=lambda: self._fingerprint(entry, parameters),
            regions=truth.regions,
            visibility=truth.visibility,
            attributes=truth.attributes,
            fps=scene.fps,
            masks=scene.mask,
            image_size=scene.size,
        )

    def tree(self, name: str) -> str:
        """Return the digest of the syntax trees that define a sequence's scenes.

        The digest covers the modules of `datasets/synthetic`. No other module affects pixels or
        ground truth.
        """
        return _scene_tree(self.entries[name].module)

    def _fingerprint(self, entry: SequenceEntry, parameters: SequenceParameters) -> str:
        tree = self.tree(entry.name)
        stored = find_version(entry.name, self.golden)
        version_identity = [tree] if stored is None else stored.identity(tree)
        identity = [entry.name, _identity(parameters), *version_identity]
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:16]


@cache
def _scene_tree(module: str) -> str:
    """Return the digest of a scene module; it is cached, because every stored run needs it."""
    file = FOLDER.parents[2].joinpath(*module.split("."))
    return tree_digest(file.with_suffix(".py"), FOLDER)


def _identity(parameters: SequenceParameters) -> dict[str, Any]:
    """Return all parameters by name, without parameters marked `later` that have their defaults.

    Parameters marked `later` are newer than stored results; their defaults do not change a scene.
    """
    later = {
        name: field.default
        for name, field in type(parameters).model_fields.items()
        if isinstance(field.json_schema_extra, dict) and field.json_schema_extra.get("later")
    }
    values = parameters.model_dump()
    return {name: value for name, value in values.items() if later.get(name, ...) != value}
