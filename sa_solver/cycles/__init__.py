"""Loading histories and cycles of frictional contacts: loops, slips and energies."""
