"""Models of motion a mission can ask for.

Only the double integrator's plans become polynomials that fly: accelerations there are bounded and piecewise constant.
The other models are for studies and for robots of other kinds.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import Literal

from missions.fields import Vector, field

IDENTIFIER = "[A-Za-z][A-Za-z0-9_]{0,31}"
FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt")
MAX_EXPRESSION = 500  # characters: bounds what the parser has to look at
_NODES = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.Call, ast.Name, ast.Constant, ast.Load)
_OPERATORS = (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd)


@dataclass(frozen=True)
class DoubleIntegratorModel:
    """Controls are accelerations, bounded per axis by limits.acceleration: what Crazyflies fly."""

    type: Literal["double_integrator"] = "double_integrator"


@dataclass(frozen=True)
class SingleIntegratorModel:
    """Controls are velocities, bounded by limits.speed; limits.acceleration does not count. Not to fly."""

    type: Literal["single_integrator"] = "single_integrator"


@dataclass(frozen=True)
class CasadiModel:
    """Any model dx/dt = f(x, u), written as expressions; needs the optional package casadi. Not to fly.

    Where controls change velocities but do not set them, searches begin with a point mass under limits.acceleration.
    """

    states: tuple[str, ...] = field(
        "names of the states; the first ones, one an axis, are the position", items=(2, 32), pattern=IDENTIFIER
    )
    controls: tuple[str, ...] = field("names of the controls", items=(1, 16), pattern=IDENTIFIER)
    derivative: tuple[str, ...] = field(
        f"dx/dt, one expression a state: + - * / **, numbers, pi, {', '.join(FUNCTIONS)}", items=(2, 32)
    )
    lower: Vector = field("least value of each control", items=(1, 16))
    upper: Vector = field("largest value of each control", items=(1, 16))
    initial: Vector = field("states beyond the position at the start; default: zeros", default=(), items=(0, 30))
    type: Literal["casadi"] = "casadi"


MotionModel = DoubleIntegratorModel | SingleIntegratorModel | CasadiModel


def flies(model: MotionModel) -> bool:
    """Whether plans of this model become polynomials."""
    return isinstance(model, DoubleIntegratorModel)


def fault(model: MotionModel, axes: int) -> tuple[str, str] | None:
    """What is wrong with a model for a workspace of ``axes`` axes: (field, reason), or None."""
    if not isinstance(model, CasadiModel):
        return None
    n, m = len(model.states), len(model.controls)
    if n < axes:
        return "states", f"got {n} states; allowed: at least {axes}, the position comes first"
    names = (*model.states, *model.controls)
    for name in names:
        if names.count(name) > 1 or name in (*FUNCTIONS, "pi"):
            return "states", f"got {name!r} twice or as a function's name; allowed: names of their own"
    for item, count, what in (("derivative", n, "state"), ("lower", m, "control"), ("upper", m, "control")):
        if len(getattr(model, item)) != count:
            return item, f"got {len(getattr(model, item))} items; allowed: {count}, one a {what}"
    if model.initial and len(model.initial) != n - axes:
        return "initial", f"got {len(model.initial)} numbers; allowed: {n - axes}, one a state beyond the position"
    for k, (low, high) in enumerate(zip(model.lower, model.upper, strict=True)):
        if not low < high:
            return f"upper[{k}]", f"got {high:g}; allowed: above lower[{k}] = {low:g}"
    for k, text in enumerate(model.derivative):
        if reason := expression_fault(text, names):
            return f"derivative[{k}]", reason
    return None


def expression_fault(text: str, names: tuple[str, ...]) -> str | None:
    """Why an expression is refused, or None. Nothing but arithmetic of known names passes."""
    if len(text) > MAX_EXPRESSION:
        return f"got {len(text)} characters; allowed: at most {MAX_EXPRESSION}"
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return f"got {text[:60]!r}; allowed: an expression such as 'v * cos(theta)'"
    for node in ast.walk(tree):
        if not isinstance(node, (*_NODES, *_OPERATORS)):
            return f"got {type(node).__name__} in {text[:60]!r}; allowed: + - * / ** and {', '.join(FUNCTIONS)}"
        if isinstance(node, ast.Name) and node.id not in (*names, *FUNCTIONS, "pi"):
            return f"unknown name {node.id!r}; known: {', '.join((*names, 'pi', *FUNCTIONS))}"
        if isinstance(node, ast.Constant) and (isinstance(node.value, bool) or not isinstance(node.value, int | float)):
            return f"got {str(node.value)[:20]!r}; allowed: numbers"
        if isinstance(node, ast.Call):
            called = node.func.id if isinstance(node.func, ast.Name) else "?"
            if called not in FUNCTIONS or node.keywords or len(node.args) != (2 if called == "atan2" else 1):
                return f"got a call of {called!r} with {len(node.args)} arguments; allowed: {', '.join(FUNCTIONS)}"
    return None
