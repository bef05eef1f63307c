"""Components of the scenes, independent of any suite.

Flat pictures are `sprite`s, solids are ray-traced (`solids`), surfaces are `triangles`. A close
person is in `figure`, a street in `street`. `painting` paints in metres with the `colours` of the
palette, on `texture`s, `prints` and `finish`es. `lamp` provides light, `camera` converts it to
images. `path` and `views` provide motion of objects and street cameras, `attributes` the attributes
of a target.
"""
