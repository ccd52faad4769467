"""The cheapest model that meets the accuracy that a case asks for (``fidelity: auto``)."""
