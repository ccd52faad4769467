"""Elasticity of bodies: stiffness, stress, heat and geometric nonlinearity."""
