"""A finished run, or several side by side, on a page for people."""
