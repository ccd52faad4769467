"""Condensed bodies, and the joints and ties between them."""
