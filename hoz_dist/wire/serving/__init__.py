"""The learner's side: takes pushes, answers questions, publishes parameters and graphs."""
