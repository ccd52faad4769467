"""Stress under worn contacts."""
