"""Arithmetic written in a mission file, as CasADi expressions; parsed, never executed as Python."""

from __future__ import annotations

import ast
import importlib
import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from missions.arrays import Array
from planner.errors import PlannerError

Expression = Any  # a CasADi SX or MX; the package has no types


def casadi() -> Any:  # noqa: ANN401 - an untyped optional package
    """The package CasADi.

    Raises:
        PlannerError: it is not installed; says how to.
    """
    try:
        return importlib.import_module("casadi")
    except ImportError:
        raise PlannerError(
            "dynamics of type casadi need the optional package casadi: pip install 'ergoflie[casadi]'"
        ) from None


_BINARY: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}


def translate(text: str, symbols: Mapping[str, Expression]) -> Expression:
    """An expression of :mod:`missions.dynamics` in CasADi's terms.

    Args:
        text: the expression.
        symbols: what its names stand for.

    Raises:
        PlannerError: CasADi is not installed, or the text is no arithmetic.
    """
    ca = casadi()

    def visit(node: ast.AST) -> Expression:
        match node:
            case ast.Expression(body=body):
                return visit(body)
            case ast.Constant(value=int() | float() as value):
                return ca.SX(float(value))
            case ast.Name(id=name):
                return ca.SX(np.pi) if name == "pi" else symbols[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -visit(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return visit(operand)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return _BINARY[type(op)](visit(left), visit(right))
            case ast.Call(func=ast.Name(id=name), args=args):
                return getattr(ca, name)(*[visit(argument) for argument in args])
        raise PlannerError(f"got {ast.dump(node)[:60]} in {text[:60]!r}; allowed: arithmetic of states and controls")

    return visit(ast.parse(text.strip(), mode="eval"))


def evaluated(function: Any, *arguments: Array) -> list[Array]:  # noqa: ANN401 - a CasADi function
    """A function whose results are dense, evaluated on NumPy's memory: CasADi's own conversions take longer than it.

    Args:
        function: of columns, or mapped over columns.
        arguments: (n,) columns or (count, n) rows, one a column of the function's argument.

    Returns:
        (count, n, m) each: matrices, of one column where a result is a vector.
    """
    kept = [np.ascontiguousarray(argument, dtype=np.float64) for argument in arguments]
    count = max((len(argument) for argument in kept if argument.ndim > 1), default=1)
    buffer, run = function.buffer()
    results = []
    for index, argument in enumerate(kept):
        buffer.set_arg(index, argument.data)
    for index in range(function.n_out()):
        rows, columns = function.size_out(index)
        result = np.empty((count, columns // count, rows))  # CasADi's order: column after column
        buffer.set_res(index, result.data)
        results.append(result.transpose(0, 2, 1))
    run()
    return results
