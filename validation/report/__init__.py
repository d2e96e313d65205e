"""The report: its page, plots, schema, summary and baseline."""
