"""From samples to triangles: filtering, regressor rows, reduction."""
