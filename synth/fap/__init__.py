"""MPEG-4 facial animation parameters: what they are, and their units on a face."""
