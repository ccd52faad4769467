"""Common parts of the figures and ParaView files of all analyses."""
