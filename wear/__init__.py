"""Wear laws, surfaces, cycle stepping and kinetics."""
