"""Quadratic programs: what a solver must offer, and OSQP behind it.

    minimise  1/2 z' P z + q' z   subject to  low <= A z <= high

P and A keep their pattern throughout a trip. Iterations are bounded rather than time where a trip must repeat bit for
bit; a real-time loop adds a time limit.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import MissingExtraError

Array = NDArray[np.float64]


class QpSolver(Protocol):
    """Solves one quadratic program after another, each from the solution of the one before."""

    def cost(self, quadratic: Array) -> None:
        """Take another P, (n, n), symmetric positive definite, from now on."""
        ...

    def solve(self, linear: Array, low: Array, high: Array, start: Array) -> Array | None:
        """Minimiser z, (n,), for q (n,) and bounds (m,), warm-started; None where none was found in the budget."""
        ...


def _libraries() -> tuple[Any, Any]:
    """OSQP and scipy's sparse matrices."""
    try:
        import osqp
        from scipy import sparse
    except ImportError as error:
        raise MissingExtraError("Tracking with MPC needs a QP solver (osqp).", extra="motion") from error
    return osqp, sparse


class OsqpSolver:
    """OSQP (Stellato et al., 2020), dense P and sparse A."""

    def __init__(
        self, quadratic: Array, constraints: Array, *, max_iterations: int = 1000, time_limit_s: float | None = None
    ) -> None:
        """Args: P; A, (m, n); bound of the iterations; bound of the time of one solution, none by default.

        Raises:
            MissingExtraError: OSQP is not installed.
        """
        osqp, sparse = _libraries()
        size = len(quadratic)
        rows = np.triu_indices(size)
        self._order = np.lexsort((rows[0], rows[1]))  # by columns, as a sparse matrix holds them
        self._rows = rows
        upper = sparse.csc_matrix((np.ones(len(rows[0])), rows), shape=(size, size))
        upper.data = quadratic[rows][self._order]
        budget: dict[str, Any] = {} if time_limit_s is None else {"time_limit": time_limit_s}
        self._solver: Any = osqp.OSQP()
        self._solver.setup(
            upper,
            np.zeros(size),
            sparse.csc_matrix(constraints),
            -np.ones(len(constraints)),
            np.ones(len(constraints)),
            verbose=False,
            eps_abs=1e-5,
            eps_rel=1e-5,
            max_iter=max_iterations,
            check_termination=5,
            adaptive_rho_interval=25,  # by iterations: by time, no trip would repeat
            warm_starting=True,
            **budget,
        )
        status: Any = osqp.SolverStatus
        self._solved = int(status.OSQP_SOLVED)

    def cost(self, quadratic: Array) -> None:
        self._solver.update(Px=quadratic[self._rows][self._order])

    def solve(self, linear: Array, low: Array, high: Array, start: Array) -> Array | None:
        self._solver.update(q=linear, l=low, u=high)
        self._solver.warm_start(x=start)
        result = self._solver.solve(raise_error=False)
        return np.asarray(result.x) if result.info.status_val == self._solved else None


def osqp_solver() -> type[OsqpSolver]:
    """OSQP, known to be installed. Raises MissingExtraError."""
    _libraries()
    return OsqpSolver
