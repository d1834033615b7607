"""What comes out: tables, fronts, rows of pictures, verdicts, one page; all made of records."""
