"""The outer skin: command line, scenario files, records, reports, the debugger, lessons."""
