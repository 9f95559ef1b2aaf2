"""Reading what a passenger means."""
