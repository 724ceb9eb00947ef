"""Random rigid motions, lines and phi-models for tests by property."""

import numpy as np
from hypothesis import strategies as st

from core.geometry import Array, Line, transform
from core.phi_convention import Convention, convention_for
from core.phi_model import PhiModel, axes

SEEDS = st.integers(0, 2**32 - 1)


def random_rotation(rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else q[:, ::-1]


def random_motion(rng: np.random.Generator, reach_m: float = 3.0) -> Array:
    return transform(random_rotation(rng), rng.uniform(-reach_m, reach_m, 3))


def random_line(rng: np.random.Generator) -> Line:
    return Line(rng.uniform(-1, 1, 3), rng.normal(size=3))


def random_model(rng: np.random.Generator, sliding: tuple[bool, ...]) -> PhiModel:
    """A phi-model of the base-frame rule, with every Z_phi well away from the axis that follows."""
    n = len(sliding)
    slides = np.array(sliding)
    a, b = rng.uniform(-0.8, 0.8, n - 1), rng.uniform(-0.8, 0.8, n - 1)
    alpha, theta = rng.uniform(0.5, np.pi - 0.5, n - 1), rng.uniform(-np.pi, np.pi, n - 1)
    phi = rng.uniform(-np.pi, np.pi, n - 1)
    phi[0], b[0], alpha[0] = np.pi / 2, 0.0, np.pi / 2
    theta[0] = rng.choice([-1, 1]) * rng.uniform(0.5, np.pi - 0.5)
    a[slides[1:]] = b[slides[1:]] = 0.0
    return PhiModel(phi, a, b, alpha, theta, slides)


def convention_of(model: PhiModel) -> Convention:
    """The rule under which a model's own axes give it back."""
    return convention_for(axes(model), model.sliding, model.phi_rad, y_reference=np.array([0.0, 1.0, 0.0]))
