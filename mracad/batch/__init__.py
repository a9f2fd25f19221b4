"""Many files through one recipe: isolated workers, a manifest that survives kills, a cluster.  Loads no kernel itself."""
