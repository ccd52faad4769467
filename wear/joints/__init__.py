"""Joint laws: what a contact transmits when it is one spring of a vibrating structure."""
