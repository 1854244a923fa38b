"""Pictures, drawn into figures of their own: no pyplot, no display."""
