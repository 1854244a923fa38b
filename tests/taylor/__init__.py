"""Tests of Taylor steps."""
