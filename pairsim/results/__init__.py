"""Reads, writes and draws a folder; never solves."""
