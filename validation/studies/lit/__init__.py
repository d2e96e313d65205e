"""Pictures by radiosity against random paths."""
