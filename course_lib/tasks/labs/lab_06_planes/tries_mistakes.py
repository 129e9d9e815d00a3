"""The wrong answers of task 1 of lab 06, how often to try, as learner code: the plain solution with one thing wrong."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_tries(
    good: str = "np.sum(w**sample)",
    number: str = "np.log(1 - confidence) / np.log(1 - good)",
    rounded: str = "np.ceil",
) -> str:
    return (
        "def tries_needed(shares, sample, confidence):\n"
        f"    w = np.asarray(shares)\n    good = {good}\n    return int({rounded}({number}))\n"
    )


TRIES_MISTAKES = (
    Misconception(
        "shares added first",
        "the shares added before the power, as if three points of three walls made a plane: a sample is good when all "
        "its points are of one plane",
        _wrong_tries("np.sum(w) ** sample"),
    ),
    Misconception(
        "largest plane alone",
        "the number of tries for the largest plane alone: a sample on any other will do, so their chances add up",
        _wrong_tries("np.max(w) ** sample"),
        variants=(_wrong_tries("w[0] ** sample"),),
    ),
    Misconception(
        "smallest plane alone",
        "the number of tries for the smallest plane: a sample on any plane will do, so their chances add up",
        _wrong_tries("np.min(w) ** sample"),
        variants=(_wrong_tries("w[-1] ** sample"),),
    ),
    Misconception(
        "tries of all planes added",
        "the tries for one plane after the other: a sample on any plane will do, so add up the chances of one sample",
        "def tries_needed(shares, sample, confidence):\n"
        "    w = np.asarray(shares)\n"
        "    return int(np.sum(np.ceil(np.log(1 - confidence) / np.log(1 - w**sample))))\n",
        variants=(
            "def tries_needed(shares, sample, confidence):\n"
            "    w = np.asarray(shares)\n"
            "    return int(np.ceil(np.sum(np.log(1 - confidence) / np.log(1 - w**sample))))\n",
        ),
    ),
    Misconception(
        "mean of the chances",
        "the mean of the planes' chances: a sample on any of them will do, so their chances add up",
        _wrong_tries("np.mean(w**sample)"),
        variants=(_wrong_tries("np.mean(w) ** sample"),),
    ),
    Misconception(
        "planes tried one by one",
        "chances joined as if each plane had a sample of its own: one sample lies on one plane or on another, so its "
        "chances add up",
        _wrong_tries("1 - np.prod(1 - w**sample)"),
    ),
    Misconception(
        "product over the planes",
        "the chances multiplied over the planes, as if a sample had to lie on all of them: any will do, so add",
        _wrong_tries("np.prod(w) ** sample"),
    ),
    Misconception(
        "outlier share",
        "the share of outliers taken for that of inliers: a sample is good when all its points are inliers",
        _wrong_tries("(1 - np.sum(w)) ** sample"),
        variants=(_wrong_tries("np.sum((1 - w) ** sample)", "np.log(1 - confidence) / np.log(abs(1 - good))"),),
    ),
    Misconception(
        "no power of the sample",
        "one good point taken for a good sample: all points of a sample must lie on one plane, so raise each share to "
        "the power of their number",
        _wrong_tries("np.sum(w)"),
    ),
    Misconception(
        "confidence for failure",
        "the logarithm of the confidence: what may be at most 1 - p is the chance that every sample is bad",
        _wrong_tries(number="np.log(confidence) / np.log(1 - good)"),
    ),
    Misconception(
        "rounded down",
        "a number of tries rounded down, which stays just below the confidence: round up",
        _wrong_tries(rounded="np.floor"),
    ),
    Misconception(
        "rounded to the nearest",
        "a number of tries rounded to the nearest, which may stay just below the confidence: round up",
        _wrong_tries(rounded="round"),
    ),
    Misconception(
        "not rounded",
        "a number of tries with a fraction: nobody draws half a sample, so round up",
        _wrong_tries(rounded="").replace("int(", "float("),
    ),
    Misconception(
        "tries on average",
        "the number of tries until the first good sample on average, without any confidence in it: use both logarithms",
        _wrong_tries(number="1 / good"),
        variants=(_wrong_tries(number="1 / good", rounded="round"),),
    ),
    Misconception(
        "always three points",
        "samples of three points whatever was asked: use the size of the sample that you are given",
        _wrong_tries("np.sum(w**3)"),
    ),
    Misconception(
        "always 0.99",
        "a confidence of 0.99 whatever was asked: use the confidence that you are given",
        _wrong_tries(number="np.log(0.01) / np.log(1 - good)"),
    ),
    Misconception(
        "good for bad samples",
        "the logarithm of the chance of a good sample: a sample is bad with probability 1 minus that",
        _wrong_tries(number="np.log(1 - confidence) / np.log(good)"),
    ),
    Misconception(
        "times for power",
        "the shares times the size of the sample: chances that must all come true are multiplied, w**sample",
        _wrong_tries("np.sum(w * sample)", "np.log(1 - confidence) / np.log(abs(1 - good))"),
    ),
    Misconception(
        "logarithm of the quotient",
        "the logarithm of a quotient, where the quotient of two logarithms is asked",
        _wrong_tries(number="np.log((1 - confidence) / (1 - good))"),
        variants=(_wrong_tries(number="abs(np.log((1 - confidence) / (1 - good)))"),),
    ),
    Misconception(
        "one try always",
        "one try whatever was asked: is the quotient upside down, or were the logarithms forgotten",
        _wrong_tries(number="np.log(1 - good) / np.log(1 - confidence)"),
    ),
    Misconception(
        "tries and confidence exchanged",
        "log(1 - good) divided by the logarithm of the confidence: the quotient is upside down, with p for 1 - p",
        _wrong_tries(number="np.log(1 - good) / np.log(confidence)"),
    ),
)
