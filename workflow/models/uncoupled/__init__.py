"""Sources of loads that wear does not change, as models: two bodies, and given resultants."""
