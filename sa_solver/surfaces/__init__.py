"""Shapes and scans of contact faces, and the resolution of their contact by a grid."""
