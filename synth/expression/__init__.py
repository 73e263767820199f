"""From emotion to motion: PAD values to partial expression parameters (PEP), and those to FAPs."""
