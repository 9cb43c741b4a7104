"""Properties decided on what has happened: recordings, frames of a whiteboard, logs of other programs."""
