"""Trials of `purelight-catalogue`: how much sooner two workers are, and what faults cost."""
