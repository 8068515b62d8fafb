"""The page of `ident gap`."""
