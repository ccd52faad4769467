"""Layout of results: what each dataset is, for models and analyses alike."""
