"""Stress of the bodies of a wear model, and under its contacts."""
