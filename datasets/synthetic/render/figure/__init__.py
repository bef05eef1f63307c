"""Person at close range: a textured mesh on bones, and its routine."""
