"""Tables of what simulated passengers say."""
