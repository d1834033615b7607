"""The intermediate form: statements over static arrays, which every printer reads."""
