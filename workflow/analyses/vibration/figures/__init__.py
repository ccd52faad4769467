"""Figures of vibration runs."""
