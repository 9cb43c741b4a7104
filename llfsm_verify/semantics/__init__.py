"""The meaning of an arrangement, written once: arrangements become step programs here."""
