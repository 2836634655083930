"""All assembly modes of platforms on legs."""
