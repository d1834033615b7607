"""The far field of a lamp as photometric files: IES LM-63 and EULUMDAT, both ways."""
