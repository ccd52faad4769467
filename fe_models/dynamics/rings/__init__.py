"""Rings of identical sectors, and waves that travel round them."""
