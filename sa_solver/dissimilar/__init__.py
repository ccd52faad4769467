"""Contact of dissimilar elastic bodies: pressure and shear solved together."""
