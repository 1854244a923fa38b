"""Pictures, reports and the live viewer."""
