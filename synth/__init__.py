"""From PAD values to an expressive face on video: a clip is a pure function of its specification."""
