"""Approximations of a wear case: their settings from coarse to fine, and the errors due to them."""
