"""Commands that work on files other than cases, such as measured loops, scans and meshes."""
