"""Cases and their numbers as text: templates, schemas, error messages and reports."""
