"""Wear runs for ParaView."""
