"""What the capabilities share: pieces of work that resume, progress in the log, the shell of a result, cost, tables."""
