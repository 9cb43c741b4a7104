"""Step programs made from other step programs. Each file says which runs and verdicts its transformation keeps."""
