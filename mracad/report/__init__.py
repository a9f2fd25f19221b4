"""Reports as single HTML files: pictures, a model to turn, tables; nothing is fetched when one is opened."""
