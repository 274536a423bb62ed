"""What the commands do beyond reading options and printing; notebooks call the same.

A flow takes an open store and a record of what is wanted, tells a listener how far it is, and
returns a record of what it did.
"""
