"""Speech: sound with the times of its phones and words, by a voice or from a recording."""
