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
# One line of code, to rehearse the whole way of a lab: read the task, replace the stub, run the check, hand in.
# The lab takes ten minutes, most of them reading.

# %%
import numpy as np

from course_lib.notebook import check

# %% [markdown]
# ## How a lab works
#
# - A task is a function that raises `NotImplementedError` until you write it. Replace the `raise` line by your code.
# - Run the cell of the function, then the check below it: `Shift+Enter` on each.
# - The check calls your function on small cases whose answers are known, and shows a card. Is the answer wrong, then the
#   card says by how much and where. Try again and it says what the mistake looks like, then what to read.
# - Hints are folded: open one only when you want it. Nothing counts how often you try.

# %% [markdown]
# ## Task 1 — millimetres to metres (1 point)
#
# A depth camera stores each pixel as a whole number. A RealSense stores **millimetres**; 0 says that nothing was measured.
# This course computes in **metres**. Convert.
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
# Arithmetic on a NumPy array works on every pixel at once: no loop is needed. `/` keeps what is behind the point, `//` drops
# it.
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
# 1. Choose **Kernel → Restart Kernel and Run All Cells…**. A lab is marked from top to bottom on a fresh kernel, so this
#    shows you what will be marked: every card must look as it did before.
# 2. Save with `Ctrl+S` (`Cmd+S` on a Mac).
# 3. Hand in this one file from your `my_work` folder, in the place that your instructor named. Keep its name.
#
# Marking runs your function on new cases of the same kind, so an answer that passes here passes there. A task that you
# leave open costs only its own points, and nothing you add, delete or move elsewhere in the notebook changes them.
# To begin again, `python3 course.py reset 00` makes a fresh copy beside yours and overwrites nothing.
