"""Grading through nbval. Read in this order: `intake` (a download to submissions), `release` (a lab as it was given
out, and answers put back into it), `run` (one kernel in a sandbox, the judgement outside it, and many of them),
`ledger` (what is kept, and which attempt counts), `tell` (pages, exports, explanations) and `verbs` (the commands).
"""
