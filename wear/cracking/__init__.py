"""Crack initiation in fretting: life parameters and the stresses that they need."""
