"""Motion in time, and what is measured from it."""
