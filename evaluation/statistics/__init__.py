"""Statistics of perceptual studies: arrays and frames in, frozen results out."""
