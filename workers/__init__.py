"""The actor process: explores rooms, rolls out episodes, computes gradients and pushes them to the learner."""
