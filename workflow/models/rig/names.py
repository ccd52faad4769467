"""Names of the displacements of a structure."""

MODE = r"(.* )?mode \d+"
"""Pattern of the names of modal displacements, of whichever body."""
