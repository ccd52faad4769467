"""What cases of wear are made of, whatever loads their contacts."""
