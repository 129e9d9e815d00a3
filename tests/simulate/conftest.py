"""Small scenes whose geometry can be computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from walls import grey, upright_wall

from course_lib.simulate import shapes
from course_lib.simulate.scenes import Scene, Surface, desk, living_room


@pytest.fixture(scope="session")
def sphere_and_wall() -> Scene:
    """A sphere of radius 0.5 m about (0.1, 2, 0), finely faceted, before a wall at y = 4."""
    T = np.eye(4)
    T[:3, 3] = (0.1, 2.0, 0.0)
    ball = Surface("ball", shapes.sphere(0.5, 1200).moved(T), grey(200))
    return Scene([upright_wall(4.0), ball])


@pytest.fixture(scope="session")
def room() -> Scene:
    return living_room(7)


@pytest.fixture(scope="session")
def desk_scene() -> Scene:
    return desk(7)
