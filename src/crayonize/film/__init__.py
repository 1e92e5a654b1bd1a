"""A film of the drawing as it is made."""
