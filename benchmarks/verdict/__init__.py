"""The verdict beside the truth: does it say good when it is good?"""
