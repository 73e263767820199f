"""Instruments, study designs and statistics of perceptual studies: pure functions of data."""
