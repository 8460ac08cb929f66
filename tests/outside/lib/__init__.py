"""What the outside programs share. Plain Python, but for `ply`, which needs numpy."""
