"""Safety: checks that judge a plan before it is driven, and a shield that has the last word while it is."""
