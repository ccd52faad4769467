"""The two specimens of a friction rig as models: reduced, and worn in cycle blocks."""
