"""German, Spanish, French and Chinese: a closed table of whole sentences for each, and its reader."""
