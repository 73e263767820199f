"""From a sentence to prosodic words, how they are meant, and what the sentence is for."""
