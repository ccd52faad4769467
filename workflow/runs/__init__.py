"""Running cases: one into its folder, many side by side or on a cluster, and checking them."""
