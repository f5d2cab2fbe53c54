"""What all laboratories share: changed cases, models, pieces of work, timing, tables, pages."""
