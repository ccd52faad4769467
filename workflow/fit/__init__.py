"""``fretscale fit``: parameters of a case from measurements, with their bounds."""
