"""What the arm is, without hardware. The only part of wamctl that ident and sim_bus may import."""
