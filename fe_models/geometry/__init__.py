"""Parametric geometries, meshed with gmsh."""
