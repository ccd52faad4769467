"""Output of wear runs for ParaView."""
