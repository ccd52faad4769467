"""Elastic half-spaces on a grid: displacements and stresses under surface tractions."""
