"""One planner on every benchmark that it can take: the runs, the score card of them, and two cards compared."""
