"""The operating system: threads, processes, files, terminal and signals."""
