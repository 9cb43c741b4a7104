"""The front door: what `import llfsm_verify` gives, as thin wrappers around the values of the rooms below."""
