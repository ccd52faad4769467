"""HTML reports of a finished run, or of several side by side."""
