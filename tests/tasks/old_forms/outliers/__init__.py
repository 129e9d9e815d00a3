"""Lab 05 before its tasks left the lesson's situation: one length for all depths, and no second view."""
