"""Where fretting cracks start: life parameters and the stresses they need."""
