"""What all laboratories share: models, states, pieces of work that are kept, timing, tables, pictures, results."""
