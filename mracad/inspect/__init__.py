"""What can be seen of a face: where it lies on its surface, how rough it is."""
