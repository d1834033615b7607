"""The training report: what was learned beside what is true, as one HTML page."""
