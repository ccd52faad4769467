"""Error budget of a wear run: errors due to link, mesh, increments, grid, steps and solver."""
