"""What lies in the folder that is made of a lamp."""
