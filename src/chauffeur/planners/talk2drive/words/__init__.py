"""What passengers say, as regular expressions in English."""
