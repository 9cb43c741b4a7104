"""Drawings of machines and arrangements: one neutral graph, a writer for each format."""
