"""Coverage: what runs have tried of the charts in them, and what not.

`counts` adds, `counting` reads runs, `decisions` says what decides a guard, `reasons` writes,
`files` keeps.
"""
