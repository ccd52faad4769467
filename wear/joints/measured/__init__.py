"""Measured hysteresis loops of joints."""
