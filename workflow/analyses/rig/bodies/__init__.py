"""Bodies that a rig consists of: masses, reduced bodies, matrices and specimens."""
