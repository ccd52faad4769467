"""Normal contact: pressures under imposed forces or motions."""
