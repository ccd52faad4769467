"""Structures: geometry and meshes, elasticity, reduction to the interfaces, structural friction."""
