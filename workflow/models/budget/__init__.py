"""Error budget of a wear model: errors due to link, mesh, increments, grid, steps and solver."""
