"""What a person meets: the command line, the report and the dashboard. It computes nothing; ``core`` does."""
