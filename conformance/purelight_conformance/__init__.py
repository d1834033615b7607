"""The conformance suite: vectors for every host, and the command that puts them to one."""
