"""Machine code from plain Python functions of a small subset, by LLVM or as C99.

It knows nothing of what it translates. `translate` says what the subset is and turns functions into
the typed program of `tree`; `llvm` and `c99` print it; `objects` compiles and loads it; `layout`
describes the memory that arguments are in. `whole_numbers` is a library written in the subset.
"""
