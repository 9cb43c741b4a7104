"""Ports: how the inputs of a running arrangement come from the world, and its outputs go there."""
