"""Shapes and scans of contact faces, and whether a grid resolves their contact."""
