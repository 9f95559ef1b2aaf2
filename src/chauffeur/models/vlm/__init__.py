"""The on-board VLM's recipe: rendered pictures, wishes with their styles, a network of half a million weights."""
