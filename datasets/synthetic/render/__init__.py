"""What scenes are made of: textures, sprites, meshes, solids and rays; paint, light, the camera."""

__all__: list[str] = []
