"""The parts of `hoz-dist reproduce`: its measurement, its processes, what each does, and the files that come of it."""
