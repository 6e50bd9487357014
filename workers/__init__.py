"""The actor process: explores rooms, rolls out episodes, computes gradients and keeps parameters and graphs fresh."""
