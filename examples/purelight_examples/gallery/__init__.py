"""All lamps and rooms, trained and rendered by one command."""
