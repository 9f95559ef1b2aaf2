# highway-env's own annotations contradict its code (a lane's line types, its random generator); these are what we use.
