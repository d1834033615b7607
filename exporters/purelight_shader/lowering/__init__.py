"""From a vetted network to the intermediate form, operator by operator."""
