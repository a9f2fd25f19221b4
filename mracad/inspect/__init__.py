"""Measurements of faces and seams, their roughness, and verdicts on documents and files."""
