"""Small models that run in the car."""
