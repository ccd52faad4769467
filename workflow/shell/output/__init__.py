"""Results of a run as all analyses write them: datasets, tables, curves and the summary."""
