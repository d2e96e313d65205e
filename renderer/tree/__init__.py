"""Trees: building, checking and refitting them."""
