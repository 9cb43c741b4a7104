"""Changes of an arrangement that runs: whether one may be made where the run stands."""
