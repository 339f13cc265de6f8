"""The scene around what a view draws: its surfaces as meshes, their edges and outlines, its outer walls, and all of these on a stage."""
