"""Work with files: the two stages, pieces that resume, progress in the log, folders of results, cost, tables."""
