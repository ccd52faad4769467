"""Figures of wear runs."""
