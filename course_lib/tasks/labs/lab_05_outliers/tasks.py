"""Lab 05: a threshold with a cost, distances in pixels, a second view, what wrong settings leave behind, a deep room.

Points are metres in the camera's frame (x right, y down, z forward). A point never counts among its own neighbours, and
a mask `keep` is True where a point stays.
"""

from __future__ import annotations

from course_lib.tasks.core import Task
from course_lib.tasks.judges import judge_array, judge_number
from course_lib.tasks.kinds import in_words, which_cause
from course_lib.tasks.labs.lab_05_outliers.cleaning import (
    CLEAN_MISTAKES,
    clean_distance,
    desk,
    guess_clean,
    judge_clean,
)
from course_lib.tasks.labs.lab_05_outliers.cutting import CUT_TOLERANCE, cut_cases
from course_lib.tasks.labs.lab_05_outliers.distances import DISTANCE_MISTAKES
from course_lib.tasks.labs.lab_05_outliers.mistakes import (
    CAUSE_OF,
    CAUSES,
    CUT_MISTAKES,
    MEND_MISTAKES,
    MORE_CUT_MISTAKES,
    MORE_MEND_MISTAKES,
    WHICH_MISTAKES,
)
from course_lib.tasks.labs.lab_05_outliers.parts import part_of_clean, part_of_cut, part_of_radius
from course_lib.tasks.labs.lab_05_outliers.pixels import DISTANCE_TOLERANCE, distance_cases
from course_lib.tasks.labs.lab_05_outliers.second_view import judge_mask, radius_cases

TASKS = (
    Task(
        id="05-1",
        title="where to cut",
        points=1,
        version=3,
        kind="fill",
        signature="def where_to_cut(mean, wrong, edges, cost)",
        cases=cut_cases,
        judge=lambda case, answer: judge_number(answer, case.truth, CUT_TOLERANCE, "px", "the place to cut"),
        misconceptions=CUT_MISTAKES + MORE_CUT_MISTAKES,
        anatomy=part_of_cut,
        where="lesson 05, section 2 (how far are the neighbours?)",
    ),
    Task(
        id="05-2",
        title="mean distance in pixels",
        points=3,
        version=3,
        kind="write",
        signature="def mean_distances(points, k, fx)",
        cases=distance_cases,
        judge=lambda case, answer: judge_array(answer, case.truth, DISTANCE_TOLERANCE, "px", what="the mean distance"),
        misconceptions=DISTANCE_MISTAKES,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.mean_distances", "course_lib.cloud.outliers.keep_by_statistics"),
        data=("tum_pair",),
        where="lesson 05, section 2 (how far are the neighbours?) and section 5 (a pipeline, tuned and reported)",
    ),
    Task(
        id="05-3",
        title="mend a filter by a second view",
        points=3,
        version=4,
        kind="mend",
        signature="def keep_by_radius(points, others, radius, least)",
        cases=radius_cases,
        judge=judge_mask,
        misconceptions=MEND_MISTAKES + MORE_MEND_MISTAKES,
        anatomy=part_of_radius,
        may_call=("numpy", "scipy.spatial"),
        hides=("course_lib.cloud.outliers.keep_by_radius",),
        where="lesson 05, section 3 (how many neighbours?)",
    ),
    which_cause(
        "05-4",
        "which setting made this",
        CAUSE_OF,
        "the five desks above",
        WHICH_MISTAKES,
        "lesson 05, sections 2 to 4, and Break it",
        causes=CAUSES,
        version=2,
    ),
    Task(
        id="05-5",
        title="clean a desk in a deep room",
        points=4,
        version=3,
        kind="open",
        signature="def clean(points)",
        cases=lambda rng: [desk(rng)],
        judge=judge_clean,
        distance=clean_distance,
        misconceptions=CLEAN_MISTAKES,
        anatomy=part_of_clean,
        refused=part_of_clean,
        may_call=("numpy", "scipy.spatial", "scipy.sparse", "scipy.sparse.csgraph"),
        hides=("course_lib.cloud.clusters.euclidean_clusters",),
        guess=guess_clean,
        where="lesson 05, section 4 (islands) and section 5 (a pipeline, tuned and reported)",
    ),
    in_words(
        "05-6",
        "explain why repeating never ends",
        (
            "0: says that the cloud must be very noisy, or that more passes are needed.",
            "1: gives a cause: the threshold comes from the cloud itself and moves in as the deviation shrinks, or "
            "each pass measures anew, so that whoever lost a neighbour is next; or names a threshold fixed once.",
            "2: both: one of the two causes, and one fixed threshold (metres, multiples of the spacing, a median).",
        ),
        "lesson 05, Break it",
        version=2,
    ),
)
