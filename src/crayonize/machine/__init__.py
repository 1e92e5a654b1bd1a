"""The machine: the cache folder, compiled kernels, memory and cores."""
