"""What scenes are made of: knobs, paths, textures, sprites, light, noise."""

__all__: list[str] = []
