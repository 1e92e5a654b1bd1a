"""Folders of photos: each becomes a picture, none is lost, whatever happens on the way."""
