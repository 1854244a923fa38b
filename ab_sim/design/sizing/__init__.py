"""A balancer's numbers from what a drive must do: balls, drag and start-up, each claim run."""
