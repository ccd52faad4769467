"""Wear steps of one contact over many cycles."""
