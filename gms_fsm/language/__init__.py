"""The expression language: text -> checked tree -> every other notation.

All physics and all switching of this package is written as short texts (``z >= s and v > v_c``).
Here such a text becomes a tree that can be evaluated, printed in a dialect (Python, Stateflow, C,
LaTeX ...), differentiated, and split into its atomic comparisons. Nothing is ever passed to `eval`:
the text is parsed with `ast`, only nodes on an allow-list are accepted, and code is generated from
the checked tree alone. Every reader of a tree is an algebra for `fold`.

Grammar: numbers, declared names, ``pi``, ``+ - * / **``, ``< <= > >=`` (chains are split),
``and or not``, ``abs exp log sqrt sgn min max sin cos tanh
atan asinh floor round mod quantise saturate if noise``. ``==`` compares whole numbers, such as
``round(n)``; on floats it is refused.
``pow(a, b)`` and ``a if c else b``, which generated code contains, are read as ``a**b`` and
``if(c, a, b)``.

Nothing in this package knows about friction.
"""

from gms_fsm.language._derivative import derivative
from gms_fsm.language._dialects import (
    C99,
    ECMASCRIPT,
    LATEX,
    LEVELS,
    MATHEMATICS,
    MATLAB,
    MATLAB_LIKE,
    MODELICA,
    PYTHON,
    STRUCTURED_TEXT,
    Dialect,
    Form,
    latex_name,
    raised,
)
from gms_fsm.language._evaluate import evaluate
from gms_fsm.language._fold import Algebra, ValueAlgebra, fold
from gms_fsm.language._powers import LARGEST_PRODUCT_POWER, integer_power, product_power
from gms_fsm.language._print import EVENT, awaited, spell
from gms_fsm.language._read import Owner, parse_condition, parse_value
from gms_fsm.language._vectors import truths, values_of
from gms_fsm.language.functions import (
    ARGUMENTS,
    CHOICES,
    COMPARISONS,
    CONSTANTS,
    ELEMENTARY,
    FUNCTIONS,
    NAMESPACE,
    OPERATIONS,
    SEVERAL,
    SHORT,
    YIELDING,
    sgn,
)
from gms_fsm.language.normal import (
    Comparison,
    Requirement,
    Split,
    clauses,
    comparisons,
    frozen,
    numbers_named,
    relations,
    renamed,
    rough_points,
    split,
    substitute,
    turning_inside,
)
from gms_fsm.language.tree import (
    LASTING,
    Binary,
    Both,
    Call,
    Condition,
    Either,
    InState,
    Name,
    Negative,
    Node,
    Not,
    Number,
    Relation,
    Value,
    names_in,
    states_in,
)

__all__ = [
    "ARGUMENTS",
    "C99",
    "CHOICES",
    "COMPARISONS",
    "CONSTANTS",
    "ECMASCRIPT",
    "ELEMENTARY",
    "EVENT",
    "FUNCTIONS",
    "LARGEST_PRODUCT_POWER",
    "LASTING",
    "LATEX",
    "LEVELS",
    "MATHEMATICS",
    "MATLAB",
    "MATLAB_LIKE",
    "MODELICA",
    "NAMESPACE",
    "OPERATIONS",
    "PYTHON",
    "SEVERAL",
    "SHORT",
    "STRUCTURED_TEXT",
    "YIELDING",
    "Algebra",
    "Binary",
    "Both",
    "Call",
    "Comparison",
    "Condition",
    "Dialect",
    "Either",
    "Form",
    "InState",
    "Name",
    "Negative",
    "Node",
    "Not",
    "Number",
    "Owner",
    "Relation",
    "Requirement",
    "Split",
    "Value",
    "ValueAlgebra",
    "awaited",
    "clauses",
    "comparisons",
    "derivative",
    "evaluate",
    "fold",
    "frozen",
    "integer_power",
    "latex_name",
    "names_in",
    "numbers_named",
    "parse_condition",
    "parse_value",
    "product_power",
    "raised",
    "relations",
    "renamed",
    "rough_points",
    "sgn",
    "spell",
    "split",
    "states_in",
    "substitute",
    "truths",
    "turning_inside",
    "values_of",
]
