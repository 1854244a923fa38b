"""Tests of collocation."""
