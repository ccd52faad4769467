"""Loads, supports and constraints on bodies."""
