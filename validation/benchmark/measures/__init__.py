"""The benchmark's measurements: builds, queries, frames, memory, whole processes."""
