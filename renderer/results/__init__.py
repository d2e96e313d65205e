"""Results of queries: records of arrays, one row a ray or point."""
