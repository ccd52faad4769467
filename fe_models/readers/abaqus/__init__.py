"""Abaqus input files: meshes, materials, contacts, supports and loads."""
