"""Pages that go with a drawing: a legend of its crayons, and steps to draw it after."""
