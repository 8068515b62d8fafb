"""The sub-commands of `ident`: options in, a workflow called, its outcome printed."""
