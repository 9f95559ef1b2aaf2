"""The command line: `chauffeur drive "..."` and what belongs to it. Only this room prints."""
