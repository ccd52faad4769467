"""Results of a contact run."""
