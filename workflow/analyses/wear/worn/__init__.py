"""What follows from the worn surfaces: loops, bolts, and the worn structure."""
