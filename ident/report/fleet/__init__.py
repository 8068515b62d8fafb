"""The pages of `ident fleet`."""
