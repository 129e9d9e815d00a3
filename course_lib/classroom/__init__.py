"""The machinery of the course: building, proving and measuring its notebooks, and the command line."""
