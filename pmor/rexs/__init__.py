"""REXS, the exchange format for gearboxes (www.rexs.info): a stage becomes a case, results become a file."""
