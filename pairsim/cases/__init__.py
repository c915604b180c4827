"""Cases: how YAML or a dict becomes a validated model; keys, units, materials, checks, estimated cost."""
