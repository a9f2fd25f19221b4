"""How the sample models are made."""
