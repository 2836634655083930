"""Well-known arms for chasles, one package each."""
