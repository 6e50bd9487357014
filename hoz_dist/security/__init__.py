"""An authority of one's own: makes the keys that let processes in, and the rules of what they may do."""
