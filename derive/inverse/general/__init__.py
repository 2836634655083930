"""General inverse of arms with five or six free joints."""
