"""Results of a rig that wears its own contact."""
