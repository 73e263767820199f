"""The face: its data, its geometry, and how it looks."""
