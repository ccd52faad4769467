"""Structures that vibrate with joints: models, excitations and integration in time."""
