"""The only room that talks to the CAD kernel: documents in, models and facts out, edits applied, files written."""
