"""What experiments show beyond the package's figures: animations, 3D scenes, tables of modes and of published facts."""
