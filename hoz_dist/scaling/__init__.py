"""What a run would do on more machines than there are: a discrete-event model fed by measured costs."""
