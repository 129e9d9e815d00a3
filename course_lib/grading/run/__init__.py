"""One submission is run in a sandboxed kernel and judged outside it; many are run by a pool of workers or a cluster."""
