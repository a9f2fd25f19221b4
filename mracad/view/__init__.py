"""Pictures of models: surfaces evaluated pixel by pixel, with numpy and Pillow only."""
