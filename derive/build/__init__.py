"""Jobs that derive generated folders from robot files, and checks of freshness."""
