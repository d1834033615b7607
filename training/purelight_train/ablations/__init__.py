"""The paper's ablations (Sec. 4): what it compares its own choices with."""
