"""The small library of the course: 3D topics, virtual sensors, tasks, notebook calls and classroom machinery.

Importing it sets two defaults that must stand before Open3D or VTK is imported, so that a kernel prints nothing of its
own and a machine without a display does not warn (both can be overridden from outside).
"""

import os
import sys

os.environ.setdefault("OPEN3D_DISABLE_WEB_VISUALIZER", "true")
if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
