"""Commands that work on other files than cases: measured loops, meshes."""
