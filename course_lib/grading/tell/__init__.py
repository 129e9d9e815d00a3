"""What grading tells people: feedback, the class report, exports, explanations, similar answers, a viva's questions."""
