"""What course.py does before there is an environment: standard library only, in the syntax of Python 3.8."""
