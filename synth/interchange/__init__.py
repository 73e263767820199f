"""Interchange: a clip's animation in the formats of other programs."""
