"""Grading through nbval: intake, rebuild, run in a sandbox, judge outside it, record, tell.

Read in this order: `intake` (a download to submissions), `released` and `rebuild` (a submission to a clean notebook),
`room` and `sandbox` (what its kernel can see), `engine` (nbval and the probes), `one` (the unit: bytes in, a record
out), `pool` and `cluster` (many of them), `ledger` (what is kept), `standing` (what counts), and the verbs.
"""
