"""A lock around Python's parser.

Python 3.11 counts the depth of the tree that ``ast.parse`` builds in one counter for all threads,
so two threads that parse at the same time make each other fail (SystemError: AST constructor
recursion depth mismatch). NumPy uses the parser too, for the header of every array in a file.
"""

from __future__ import annotations

import threading

PARSER = threading.Lock()
