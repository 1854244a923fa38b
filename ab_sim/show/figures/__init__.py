"""Pictures, drawn into separate figures without pyplot and without a display."""
