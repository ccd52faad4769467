"""Choice of the cheapest model that meets the accuracy of a case (``fidelity: auto``)."""
