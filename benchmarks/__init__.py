"""Speed against error, measured side by side in one run."""
