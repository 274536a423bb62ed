"""Active inspection: where DoI says "look again", where that is, from where, and in what order."""
