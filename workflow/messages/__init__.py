"""Registry of warnings and errors: what each code means and what to do about it."""
