"""Guards outside: processes that watch a whiteboard."""
