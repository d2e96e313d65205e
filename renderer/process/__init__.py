"""The process around the work: threads, Ctrl-C, child processes, the terminal, files written whole."""
