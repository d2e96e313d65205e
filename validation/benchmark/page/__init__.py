"""The benchmark's page: records, figures and targets."""
