"""Error against run time: the refocuser beside every other way to refocus, and extreme inputs.

`methods` holds the ways, `report` compares them, `stability` drives them to their limits.
"""
