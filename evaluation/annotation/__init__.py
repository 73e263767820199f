"""Annotation of stimuli by several raters: which are rated when, and what the ratings come to."""
