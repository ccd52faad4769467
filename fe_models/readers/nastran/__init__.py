"""Nastran bulk data: meshes, materials, contacts, supports and loads."""
