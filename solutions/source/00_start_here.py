# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Lab 00 Start here
#
# One line of code, to rehearse the whole way of a lab: read the task, replace one line, run the check, hand in. It takes five
# minutes, and most of them are reading. [Lesson 00](../notebooks/00_start_here.ipynb) is where you come from.

# %%
import numpy as np

from course_lib.notebook import check

# %% [markdown]
# ## How a lab works
#
# - A task is a function that you complete. Until you do, it raises `NotImplementedError`: replace that line by your code.
# - Run the cell of the function, then the check below it, with `Shift+Enter` on each. A check before you begin says "not
#   started yet". That is no error.
# - The check calls your function on small cases whose answers are known, and shows a card. For a wrong answer the card says
#   by how much it is off, and where. Try again, and it also says what the mistake looks like, and then what to read.
# - Hints are folded. Open one when you want it: hints and tries cost nothing.

# %% [markdown]
# ## Task 1 — millimetres to metres (1 point)
#
# A depth camera stores each pixel as a whole number. A RealSense camera stores **millimetres**, and 0 where it measured
# nothing. This course computes in **metres**. Convert.
#
# - `depth_mm`: one number, or a NumPy array of any shape, in millimetres
# - returns: the same in metres, as a float or an array of floats; 0 stays 0
#
# For example, `metres(1500)` is `1.5`.
#
# <details><summary>Hint 1: idea</summary>
#
# How many millimetres are in a metre? Should a desk at arm's length become a bigger number or a smaller one?
#
# </details>
# <details><summary>Hint 2: call</summary>
#
# Arithmetic on a NumPy array works on every pixel at once, so no loop is needed. `/` keeps what is behind the point, `//`
# drops it.
#
# </details>


# %% tags=["task"]
def metres(depth_mm):
    """Convert raw RealSense depth in millimetres to metres."""
    # BEGIN SOLUTION
    # a millimetre is a thousandth of a metre
    return depth_mm / 1000
    # END SOLUTION


# %% tags=["check"]
check("00-1", metres)

# %% [markdown]
# ## How to hand in
#
# 1. In the menu, choose **Kernel → Restart Kernel and Run All Cells…**. Your lab is marked from top to bottom in a fresh
#    kernel, so this shows what will be marked. Each card should look as it did before.
# 2. Save: `Ctrl+S`, or `Cmd+S` on a Mac.
# 3. Hand in this one file, `my_work/labs/00_start_here.ipynb`, at the place that your instructor named. Keep its name.
#
# Good to know:
#
# - Marking calls your function on new cases of the same kind. An answer that is right, and not only right for the cases of
#   the check, passes there too.
# - A task that you leave open costs its own points and no others. Cells that you add elsewhere cost nothing.
# - Want to begin again? `python3 course.py reset 00` makes a fresh copy beside yours and overwrites nothing.
