"""Thin things that bend: meshes of triangles, what is seen of them, how the camera has it."""

__all__: list[str] = []
