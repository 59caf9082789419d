"""One function per verb: paths and options in, a frozen result out.

The only room that calls files, calibrate and report together; nothing here writes to a terminal.
"""
