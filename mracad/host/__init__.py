"""Objects of other Python libraries, and how shapes go in and come out: CadQuery, build123d, the kernel's own."""
