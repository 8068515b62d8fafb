"""Forward selection: candidates, acceptance, rivals, null distribution."""
