"""The form of machine code that browsers run: JavaScript, its memory placed, its text short."""
