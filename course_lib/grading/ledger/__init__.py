"""What is kept of grading: records, decisions of people, late policies, and which attempt counts."""
