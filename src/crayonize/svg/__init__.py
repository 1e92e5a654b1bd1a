"""SVG: lines that other programs drew come in, strokes for other programs go out."""
