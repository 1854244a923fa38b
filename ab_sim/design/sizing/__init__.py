"""Sizing of a balancer from requirements: balls, drag and start-up, verified by runs."""
