"""What is measured: builds, queries, frames, memory, whole processes."""
