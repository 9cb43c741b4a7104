"""Frames in shared memory: who writes them, who reads them."""
