"""What scenes are made of; none of it knows a suite.

Flat pictures are `sprite`s, solids are met by rays (`solids`), surfaces are `triangles`; a person
from near is in `figure`, a street in `street`. `painting` paints in metres with the `colours` of
the palette, on `texture`s, `prints` and `finish`es. `lamp` lights, `camera` develops; `path` and
`views` say where things and street cameras go, `attributes` what happens to a target meanwhile.
"""
