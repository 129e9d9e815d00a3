"""Registration: the rigid motion that lays one cloud onto another, its correspondences, weights against outliers."""


def __getattr__(name: str) -> None:
    raise AttributeError(
        f"module 'course_lib.registration' has no attribute {name!r}. Its functions are in modules, such as "
        "course_lib.registration.icp; if this copy is of an earlier version of the course, "
        "`python3 course.py reset LAB` puts a fresh copy beside it."
    )
