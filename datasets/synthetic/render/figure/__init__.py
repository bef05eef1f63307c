"""A person from near: a mesh on bones, clothed and painted, moved by a routine."""
