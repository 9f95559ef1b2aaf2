"""CARLA Leaderboard 1.0 (paper, Sec. IV-B, Tab. V): official routes, scenarios and scoring over any town world."""
