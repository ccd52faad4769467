"""Contacts that wear: their loads, their tractions and their link to a structure."""
