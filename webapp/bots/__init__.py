"""Simulated raters: they open the participant's pages over HTTP, answer what these ask, and go on to the end."""
