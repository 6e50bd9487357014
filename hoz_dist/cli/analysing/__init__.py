"""The parts of `hoz-dist analyse`: it opens and names runs, has their agents act, and chooses what is drawn."""
