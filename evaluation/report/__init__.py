"""From answers to tables, figures and one readable report."""
