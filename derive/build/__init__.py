"""Jobs from robot files to generated folders, with freshness checks."""
