"""The error budget of a wear run: what link, mesh, increments, grid, steps, solver leave."""
