"""The sorters of what passengers say: wishes that are only hinted at, and remarks after a drive."""
