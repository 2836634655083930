"""From robot files to generated folders: jobs, freshness, files written."""
