"""Cyclic symmetry: one sector of a wheel."""
