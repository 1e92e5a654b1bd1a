"""From a photograph to the strokes of a crayon drawing: geometry, forces and crayons, no wax.

A stroke is a path in millimetres with a force along it, a crayon and a tip (see
`stroke_gen.drawing`). This package knows wax only as numbers it is given, and never imports the
program that draws.
"""
