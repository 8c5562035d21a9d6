"""One reader of Python texts at a time.

Python 3.11 counts the depth of the tree that ``ast.parse`` builds once for all threads, so two
threads that parse at once make each other fail (SystemError: AST constructor recursion depth
mismatch). NumPy parses the header of every array of a file.
"""

from __future__ import annotations

import threading

__all__ = ["PARSER"]

PARSER = threading.Lock()
