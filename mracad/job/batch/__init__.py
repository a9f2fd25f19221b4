"""Many files through one recipe: isolated workers, a manifest that survives kills, a cluster.

Nothing here loads the kernel: that is for the workers.
"""
