"""Meshes of structures: bodies, contact faces, element shapes and worn nodes."""
