"""Contacts that wear: their loads, tractions and link to a structure."""
