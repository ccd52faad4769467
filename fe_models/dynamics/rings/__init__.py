"""Vibration of cyclically symmetric rings of equal sectors."""
