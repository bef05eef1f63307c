"""Components that scenes of all suites use.

Renderers: `sprite` for flat images, `solids` for ray-traced solids, `triangles` for meshes.
Objects: `figure` for a person at close range, `street`, `desk`. Surfaces: `painting`, `texture`,
`prints`, `finish` and the palette `colours`. Light and camera: `lamp`, `camera`. Motion: `path`,
`views`. Ground truth: `attributes`.
"""
