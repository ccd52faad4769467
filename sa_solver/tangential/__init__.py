"""Tangential contact: shear and slip under Coulomb's law for a given pressure."""
