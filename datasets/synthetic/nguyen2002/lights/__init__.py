"""A printed thing that is moved about in a room with two lamps, of which one goes off and on."""
