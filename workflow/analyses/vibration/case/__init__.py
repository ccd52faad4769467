"""The vibration case and its sections."""
