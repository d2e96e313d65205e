"""The benchmark's page: record, figures and targets."""
