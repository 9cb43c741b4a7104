"""Runs that one walks forwards and backwards: by ringlets, by cycles, to break points; and why guards were true."""
