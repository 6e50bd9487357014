"""What `hoz-dist doctor` checks."""
