"""The intermediate form as text: one printer for Slang, one for OSL."""
