"""Contact mechanics on elastic half-spaces, and the shared types, frames and signs."""
