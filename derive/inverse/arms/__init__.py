"""Parts of loops that are solved as serial arms between known bodies."""
