"""The crayons: palettes, the pigment of each crayon, and what a crayon gives as measured on the
wax.
"""
