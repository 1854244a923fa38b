"""Faults to practise with, injected into a drive and removed again; see docs/topics.md."""
